// The page as Dash keeps it: its elements, the properties of its components, and the constants that
// `app/scripts.py` sends with it.

/**
 * @typedef {object} Constants
 * @property {number} mostCompared how many runs can be compared at most
 * @property {string} runPrefix what the address of a run begins with
 * @property {string} presentPrefix what that of its presenter view begins with
 * @property {string} importPath where a file of runs is sent to
 */

/** @type {Constants} */
export const CONSTANTS = JSON.parse(
  globalThis.document?.getElementById("constants")?.textContent ?? "{}",
);

/** @param {string} id */
export const byId = (id) => document.getElementById(id);

/**
 * Whether a component is on the page; Dash's own question throws if it is not.
 * @param {string} id
 */
function isThere(id) {
  try {
    return window.dash_component_api.getLayout(id) !== undefined;
  } catch {
    return false;
  }
}

/**
 * Sets properties of a component, if its page has not been left meanwhile: Dash's `set_props` throws
 * where the component has gone, and timers and answers come late.
 * @param {string} id
 * @param {Record<string, unknown>} props
 */
export function setProps(id, props) {
  if (isThere(id)) window.dash_clientside.set_props(id, props);
}

/** @param {string} path */
export const goTo = (path) => setProps("url", { pathname: path });

/**
 * A new element, as the last of its parent if there is one.
 * @param {string} tag
 * @param {string} className
 * @param {Element | null} [parent]
 * @param {string} [text]
 */
export function make(tag, className, parent, text) {
  const node = document.createElement(tag);
  node.className = className;
  if (text !== undefined) node.textContent = text;
  if (parent) parent.append(node);
  return node;
}

/**
 * Changes a text that is another, for the browser does not look.
 * @param {Element} node
 * @param {string} text
 */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/**
 * The nearest element around the target of an event that a selector matches.
 * @param {Event} event
 * @param {string} selector
 * @returns {HTMLElement | null}
 */
export const around = (event, selector) =>
  /** @type {HTMLElement} */ (event.target).closest?.(selector) ?? null;
