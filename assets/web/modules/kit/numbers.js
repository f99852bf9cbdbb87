// Numbers as text: readings as they are shown, and numbers as people write and paste them.

const MINUS = /^[-\u2212\u2013\uff0d]/;

/**
 * The forms that a number may have, and what makes digits of each:
 * 1,234,567.8  1 234 567,8 (with any space, or an apostrophe)  1.234.567,8  0,8  1234.5
 * @type {[RegExp, (text: string) => string][]}
 */
const FORMS = [
  [/^\d+\.?\d*$|^\.\d+$/, (text) => text],
  [/^[1-9]\d{0,2}(,\d{3})+(\.\d+)?$/, (text) => text.replaceAll(",", "")],
  [
    /^[1-9]\d{0,2}([\s'\u2019])\d{3}(\1\d{3})*([.,]\d+)?$/,
    (text) => text.replace(/[\s'\u2019]/g, "").replace(",", "."),
  ],
  [
    /^[1-9]\d{0,2}(\.\d{3})+,\d+$|^[1-9]\d{0,2}(\.\d{3}){2,}$/,
    (text) => text.replaceAll(".", "").replace(",", "."),
  ],
  [/^\d+,\d+$/, (text) => text.replace(",", ".")],
];

/**
 * With a minus sign, not a hyphen, and never "minus nothing".
 * @param {number} value
 * @param {number} decimals
 */
export function number(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/**
 * A number with its sign, as differences are shown.
 * @param {number} value
 * @param {number} decimals
 */
export function signed(value, decimals) {
  const text = number(value, decimals);
  return text.startsWith("−") ? text : `+${text}`;
}

/** @param {string} text */
export const startsWithMinus = (text) => MINUS.test(text);

/**
 * Full-width digits and signs as ASCII has them.
 * @param {string} text
 */
export function narrow(text) {
  return text.replace(/[\uff0b\uff0c\uff0e\uff10-\uff19]/g, (wide) =>
    String.fromCharCode(wide.charCodeAt(0) - 0xfee0),
  );
}

/**
 * A text without the unit that may follow its number, and without spaces around it.
 * @param {string} text
 * @param {string} [unit]
 */
export function withoutUnit(text, unit) {
  const trimmed = narrow(text).trim();
  return unit && trimmed.endsWith(unit) ? trimmed.slice(0, -unit.length).trim() : trimmed;
}

/**
 * The number that a text means, in digits; null where it means none.
 * @param {string} text
 * @param {{ unit?: string, whole?: string | boolean }} [field] what may follow the number, and
 *   whether it takes no fraction
 */
export function readNumber(text, { unit, whole } = {}) {
  let digits = withoutUnit(text, unit);
  const sign = startsWithMinus(digits) ? "-" : "";
  if (sign || digits.startsWith("+")) digits = digits.slice(1);
  const form = FORMS.find(([pattern]) => pattern.test(digits));
  if (!form) return null;
  const read = sign + form[1](digits);
  if (!whole) return read;
  return Number.isSafeInteger(Number(read)) ? String(Number(read)) : null;
}
