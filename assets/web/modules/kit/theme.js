// The theme: light or dark, as Mantine has it, and the colours that `style.css` gives it.

import { signal } from "./signal.js";

const ATTRIBUTE = "data-mantine-color-scheme";

/** Sent once the theme has changed. */
export const schemeChanged = /** @type {ReturnType<typeof signal<void>>} */ (signal());

/** @type {Map<string, string>} */
const colours = new Map();

export const scheme = () => document.documentElement.getAttribute(ATTRIBUTE) || "light";

/** @param {string} name */
export const setScheme = (name) => document.documentElement.setAttribute(ATTRIBUTE, name);

/**
 * The value of a custom property of the page, such as `--ink`.
 * @param {string} name
 */
export function colour(name) {
  let value = colours.get(name);
  if (value === undefined) {
    value = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    colours.set(name, value);
  }
  return value;
}

export function watchScheme() {
  new MutationObserver(() => {
    colours.clear();
    schemeChanged.send();
  }).observe(document.documentElement, { attributes: true, attributeFilter: [ATTRIBUTE] });
}
