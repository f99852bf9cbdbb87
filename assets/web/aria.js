// Dash Mantine's menus put what their button says of itself, that it has a menu and whether that is
// open, on a div around the button, which nobody reads out. This moves it to the button.

(function () {
  "use strict";

  const SAID = ["aria-haspopup", "aria-expanded"];

  function settle(wrapper) {
    const button = wrapper.querySelector(":scope > button");
    if (!button) return;
    for (const name of SAID) {
      const value = wrapper.getAttribute(name);
      if (value === null) continue;
      button.setAttribute(name, value);
      wrapper.removeAttribute(name);
    }
  }

  new MutationObserver((changes) => {
    for (const { target, type, addedNodes } of changes) {
      if (type === "attributes" && target.matches("div[aria-expanded]")) settle(target);
      for (const node of addedNodes) {
        if (node.nodeType !== Node.ELEMENT_NODE) continue;
        if (node.matches("div[aria-expanded]")) settle(node);
        node.querySelectorAll("div[aria-expanded]").forEach(settle);
      }
    }
  }).observe(document, { subtree: true, childList: true, attributeFilter: SAID });
})();
