// Fields for numbers. Mantine's number field drops what it does not know: of "1e3" it makes 13, of
// "1,234" 1 or 1.234. Here a text becomes the number that it means (`kit/numbers.js`), or the field
// stays as it was and says why.
//
// A field says by `data-unit` what may follow its number and by `data-whole` that it takes no fraction.

import { narrow, readNumber, startsWithMinus, withoutUnit } from "../kit/numbers.js";
import { setProps } from "../kit/page.js";

/** @typedef {HTMLInputElement} Field */

const FIELD = "input.mantine-NumberInput-input";
const LONGEST_SHOWN = 20;

/**
 * What a field held when an input method began to write into it.
 * @type {WeakMap<Field, { value: string, from: number | null, to: number | null }>}
 */
const before = new WeakMap();
/** Fields into which a comma was typed, which Mantine shows as a point. @type {WeakSet<Field>} */
const commas = new WeakSet();
/** @type {WeakSet<Field>} */
const refusing = new WeakSet();

/**
 * @param {Event} event
 * @returns {Field | null}
 */
function fieldOf(event) {
  const target = /** @type {Field} */ (event.target);
  return target.matches?.(FIELD) ? target : null;
}

/**
 * @param {Field} field
 * @param {string} text
 */
const bare = (field, text) => withoutUnit(text, field.dataset.unit);

/**
 * What stands in a field beside what is selected.
 * @param {Field} field
 */
function parts({ value, selectionStart, selectionEnd }) {
  return [value.slice(0, selectionStart ?? 0), value.slice(selectionEnd ?? value.length)];
}

/**
 * As if it had been typed: React hears of what is set behind its back only so.
 * @param {Field} field
 * @param {string} text
 */
function put(field, text) {
  const property = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
  property?.set?.call(field, text);
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

/**
 * @param {Field} field
 * @param {string | null} error
 */
const say = (field, error) => setProps(field.id, { error });

/**
 * @param {Field} field
 * @param {string} text
 */
function refuse(field, text) {
  const { unit, whole } = field.dataset;
  const trimmed = text.trim();
  const shown =
    trimmed.length > LONGEST_SHOWN ? `${trimmed.slice(0, LONGEST_SHOWN)}…` : trimmed || text;
  const example = whole
    ? "a whole number such as 1234"
    : `a number such as 1234 or 0.5${unit ? `, in ${unit}` : ""}`;
  refusing.add(field);
  say(field, `"${shown}" was not taken: write ${example}`);
}

/** @param {Field} field */
function accept(field) {
  if (refusing.delete(field)) say(field, null);
}

/**
 * A text that comes as a whole, in the place of what is selected.
 * @param {Field} field
 * @param {string} text
 */
function take(field, text) {
  if (!text.trim()) return;
  const [head, tail] = parts(field);
  const number = readNumber(bare(field, head + tail) ? head + text + tail : text, field.dataset);
  if (number === null) {
    refuse(field, text);
    return;
  }
  commas.delete(field);
  put(field, number);
  accept(field);
}

/**
 * Whether a character can go in as it is.
 * @param {Field} field
 * @param {string} character
 */
function canBeTyped(field, character) {
  const [head, tail] = parts(field);
  const rest = bare(field, head + tail);
  if (!rest) accept(field);
  if (/\d/.test(character)) return true;
  if (character === "-") return head === "" && !rest.startsWith("-");
  if (!/[.,]/.test(character) || field.dataset.whole || rest.includes(".")) return false;
  if (character === ",") commas.add(field);
  return true;
}

/** @param {ClipboardEvent} event */
function paste(event) {
  const field = fieldOf(event);
  if (!field) return;
  event.preventDefault();
  event.stopPropagation();
  take(field, event.clipboardData?.getData("text/plain") ?? "");
}

/** @param {InputEvent} event */
function type(event) {
  const field = fieldOf(event);
  if (!field || event.isComposing) return;
  if (event.inputType.startsWith("delete")) accept(field);
  const text = event.data;
  if (!text || !event.inputType.startsWith("insert")) return;
  if (text.length === 1 && canBeTyped(field, text)) return;
  event.preventDefault();
  if (text.length > 1 || narrow(text) !== text || startsWithMinus(text)) take(field, text);
  else refuse(field, text);
}

/**
 * What was typed with a comma means what it would mean when pasted.
 * @param {FocusEvent} event
 */
function leave(event) {
  const field = fieldOf(event);
  if (!field || !commas.delete(field)) return;
  const shown = bare(field, field.value);
  const number = readNumber(shown.replace(".", ","), field.dataset);
  if (number !== null && Number(number) !== Number(shown)) put(field, number);
}

/** @param {CompositionEvent} event */
function beginComposing(event) {
  const field = fieldOf(event);
  if (!field) return;
  const { value, selectionStart: from, selectionEnd: to } = field;
  before.set(field, { value, from, to });
}

/**
 * What an input method writes cannot be stopped on the way.
 * @param {CompositionEvent} event
 */
function endComposing(event) {
  const field = fieldOf(event);
  const held = field && before.get(field);
  if (!held || !event.data) return;
  before.delete(field);
  put(field, bare(field, held.value));
  field.setSelectionRange(held.from, held.to);
  take(field, event.data);
}

export function start() {
  // Mantine, too, listens to pasting: this comes first.
  document.addEventListener("paste", paste, true);
  document.addEventListener("beforeinput", type, true);
  document.addEventListener("focusout", leave, true);
  document.addEventListener("compositionstart", beginComposing, true);
  document.addEventListener("compositionend", endComposing, true);
}
