// Dash Mantine's menus put what their button says of itself, that it has a menu and whether that is
// open, on a div around the button, which nobody reads out. This moves it to the button.

const MOVED = ["aria-haspopup", "aria-expanded"];
const WRAPPER = "div[aria-expanded]";

/** @param {Element} wrapper */
function settle(wrapper) {
  const button = wrapper.querySelector(":scope > button");
  if (!button) return;
  for (const name of MOVED) {
    const value = wrapper.getAttribute(name);
    if (value === null) continue;
    button.setAttribute(name, value);
    wrapper.removeAttribute(name);
  }
}

/** @param {Element} root */
function settleAll(root) {
  if (root.matches(WRAPPER)) settle(root);
  root.querySelectorAll(WRAPPER).forEach(settle);
}

export function start() {
  new MutationObserver((changes) => {
    for (const { target, type, addedNodes } of changes) {
      if (type === "attributes" && /** @type {Element} */ (target).matches(WRAPPER)) {
        settle(/** @type {Element} */ (target));
      }
      for (const node of addedNodes) if (node instanceof Element) settleAll(node);
    }
  }).observe(document, { subtree: true, childList: true, attributeFilter: MOVED });
  settleAll(document.documentElement);
}
