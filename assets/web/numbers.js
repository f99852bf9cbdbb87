// Numbers as people write and paste them. Mantine's number field drops what it does not know: of
// "1e3" it makes 13, of "1,234" 1 or 1.234. Here a text becomes the number that it means, or the
// field stays as it was and says why.
//
// A field says by `data-unit` what may follow its number and by `data-whole` that it takes no fraction.

(function () {
  "use strict";

  const FIELD = "input.mantine-NumberInput-input";
  const MINUS = /^[-\u2212\u2013\uff0d]/;
  // 1,234,567.8  1 234 567,8 (with any space, or an apostrophe)  1.234.567,8  0,8  1234.5
  const FORMS = [
    [/^\d+\.?\d*$|^\.\d+$/, (text) => text],
    [/^[1-9]\d{0,2}(,\d{3})+(\.\d+)?$/, (text) => text.replaceAll(",", "")],
    [/^[1-9]\d{0,2}([\s'\u2019])\d{3}(\1\d{3})*([.,]\d+)?$/, (text) => text.replace(/[\s'\u2019]/g, "").replace(",", ".")],
    [/^[1-9]\d{0,2}(\.\d{3})+,\d+$|^[1-9]\d{0,2}(\.\d{3}){2,}$/, (text) => text.replaceAll(".", "").replace(",", ".")],
    [/^\d+,\d+$/, (text) => text.replace(",", ".")],
  ];

  const before = new WeakMap(); // what a field held when an input method began to write into it
  const commas = new WeakSet(); // fields into which a comma was typed, which Mantine shows as a point
  const refusing = new WeakSet();

  const fieldOf = (event) => (event.target.matches?.(FIELD) ? event.target : null);

  function narrow(text) {
    return text.replace(/[\uff0b\uff0c\uff0e\uff10-\uff19]/g, (wide) => String.fromCharCode(wide.charCodeAt(0) - 0xfee0));
  }

  function bare(field, text) {
    const { unit } = field.dataset;
    const trimmed = narrow(text).trim();
    return unit && trimmed.endsWith(unit) ? trimmed.slice(0, -unit.length).trim() : trimmed;
  }

  // The number that a text means, in digits, or null.
  function read(field, text) {
    let digits = bare(field, text);
    const sign = MINUS.test(digits) ? "-" : "";
    if (sign || digits.startsWith("+")) digits = digits.slice(1);
    const form = FORMS.find(([pattern]) => pattern.test(digits));
    if (!form) return null;
    const number = sign + form[1](digits);
    if (!field.dataset.whole) return number;
    return Number.isSafeInteger(Number(number)) ? String(Number(number)) : null;
  }

  // As if it had been typed: React hears of what is set behind its back only so.
  function put(field, text) {
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(field, text);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }

  const say = (field, error) => window.dash_clientside.mirrortwin.setProps(field.id, { error });

  function refuse(field, text) {
    const { unit, whole } = field.dataset;
    const shown = text.trim().length > 20 ? `${text.trim().slice(0, 20)}…` : text.trim() || text;
    const example = whole ? "a whole number such as 1234" : `a number such as 1234 or 0.5${unit ? `, in ${unit}` : ""}`;
    refusing.add(field);
    say(field, `"${shown}" was not taken: write ${example}`);
  }

  function accept(field) {
    if (refusing.delete(field)) say(field, null);
  }

  // A text that comes as a whole, in the place of what is selected.
  function take(field, text) {
    if (!text.trim()) return;
    const { value, selectionStart: from, selectionEnd: to } = field;
    const rest = bare(field, value.slice(0, from) + value.slice(to));
    const number = read(field, rest ? value.slice(0, from) + text + value.slice(to) : text);
    if (number === null) {
      refuse(field, text);
      return;
    }
    commas.delete(field);
    put(field, number);
    accept(field);
  }

  // Mantine, too, listens to pasting: this comes first.
  document.addEventListener("paste", (event) => {
    const field = fieldOf(event);
    if (!field) return;
    event.preventDefault();
    event.stopPropagation();
    take(field, event.clipboardData.getData("text/plain"));
  }, true);

  document.addEventListener("beforeinput", (event) => {
    const field = fieldOf(event);
    if (!field || event.isComposing) return;
    if (event.inputType.startsWith("delete")) accept(field);
    const text = event.data;
    if (!text || !event.inputType.startsWith("insert")) return;
    if (text.length === 1 && typed(field, text)) return;
    event.preventDefault();
    if (text.length > 1 || narrow(text) !== text || MINUS.test(text)) take(field, text);
    else refuse(field, text);
  }, true);

  // Whether a character can go in as it is.
  function typed(field, character) {
    const { value, selectionStart: from, selectionEnd: to } = field;
    const rest = bare(field, value.slice(0, from) + value.slice(to));
    if (!rest) accept(field);
    if (/\d/.test(character)) return true;
    if (character === "-") return from === 0 && !rest.startsWith("-");
    if (!/[.,]/.test(character) || field.dataset.whole || rest.includes(".")) return false;
    if (character === ",") commas.add(field);
    return true;
  }

  // What was typed with a comma means what it would mean when pasted.
  document.addEventListener("focusout", (event) => {
    const field = fieldOf(event);
    if (!field || !commas.delete(field)) return;
    const shown = bare(field, field.value);
    const number = read(field, shown.replace(".", ","));
    if (number !== null && Number(number) !== Number(shown)) put(field, number);
  }, true);

  // What an input method writes cannot be stopped on the way.
  document.addEventListener("compositionstart", (event) => {
    const field = fieldOf(event);
    if (field) before.set(field, { value: field.value, from: field.selectionStart, to: field.selectionEnd });
  }, true);

  document.addEventListener("compositionend", (event) => {
    const field = fieldOf(event);
    if (!field || !before.has(field) || !event.data) return;
    const { value, from, to } = before.get(field);
    before.delete(field);
    put(field, bare(field, value));
    field.setSelectionRange(from, to);
    take(field, event.data);
  }, true);
})();
