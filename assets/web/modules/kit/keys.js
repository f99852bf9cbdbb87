// The keyboard: one listener for the whole page, and one notion of who has a use for a key already.

/**
 * @typedef {(event: KeyboardEvent, within: HTMLElement | null) => void} Action
 * @typedef {object} Binding
 * @property {Record<string, Action>} keys by the key's name (`nameOf`)
 * @property {string} [within] the element that the keys are for, which the focus must be in
 * @property {() => boolean} [when] whether they are for anything now
 * @property {boolean} [always] also where somebody types
 * @property {boolean} [shared] what else is bound to the key happens, too
 */

export const TEXT_FIELDS =
  "input:not([type='radio'], [type='checkbox']), textarea, select, " +
  "[contenteditable]:not([contenteditable='false']), [role='dialog']";
export const MOVED_BY_KEYS =
  "[role='slider'], [role='radio'], input[type='radio'], input[type='checkbox']";

const MOVING = /^( |Enter|Home|End|Page(Up|Down)|Arrow(Left|Right|Up|Down))$/;

/** @type {Binding[]} */
const bindings = [];

/**
 * What a key is called here: `a`, `Escape`, `Mod+Enter` with Ctrl or ⌘. Shift is in the character.
 * @param {Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "altKey">} event
 */
export function nameOf({ key, ctrlKey, metaKey, altKey }) {
  const name = /^[A-Z]$/.test(key) ? key.toLowerCase() : key;
  return `${ctrlKey || metaKey ? "Mod+" : ""}${altKey ? "Alt+" : ""}${name}`;
}

/**
 * Whether an element has a use for a key itself: fields for text and dialogs for all, sliders and
 * choices for those that move them.
 * @param {Element} target
 * @param {string} name
 */
export function hasUseFor(target, name) {
  if (target.closest(TEXT_FIELDS)) return true;
  return MOVING.test(name) && target.closest(MOVED_BY_KEYS) !== null;
}

/**
 * Gives a key to those it is bound for, in the order in which they were bound.
 * @param {KeyboardEvent} event
 * @param {Binding[]} among
 */
export function deliver(event, among) {
  const target = /** @type {Element} */ (event.target);
  const name = nameOf(event);
  for (const { keys, within, when, always, shared } of among) {
    if (!Object.hasOwn(keys, name) || (when && !when())) continue;
    const inside = within ? /** @type {HTMLElement | null} */ (target.closest(within)) : null;
    if (within ? !inside : !always && hasUseFor(target, name)) continue;
    keys[name](event, inside);
    if (shared) continue;
    event.preventDefault();
    return;
  }
}

/**
 * Binds keys for as long as the page is there.
 * @param {Binding} binding
 */
export const onKeys = (binding) => {
  bindings.push(binding);
};

export function watchKeys() {
  document.addEventListener("keydown", (event) => {
    if (!event.defaultPrevented) deliver(event, bindings);
  });
}
