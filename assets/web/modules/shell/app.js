// What the header and the form need in the browser; everything else of them is Dash.

import { onKeys } from "../kit/keys.js";
import { byId, setProps } from "../kit/page.js";
import { scheme, schemeChanged } from "../kit/theme.js";

const NARROW_PX = 800;
const SETTLE_MS = 100;

// The server draws the 3D scenes, so it has to know the theme.
const reportScheme = () => setProps("scheme", { data: scheme() });

/**
 * Marks the page in the header.
 * @param {string | null} kind
 */
export function markPage(kind) {
  for (const link of document.querySelectorAll(".header a[id^=nav-]")) {
    if (link.id === `nav-${kind}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  // The 3D view starts on this report: let the page itself come first.
  if (kind) requestIdleCallback(reportScheme, { timeout: 1500 });
}

/**
 * On a narrow screen the form fills the view: brings the run that it started into sight.
 * @param {string | null} runId
 */
export function showRun(runId) {
  const bar = document.querySelector(".area-bar");
  if (runId && bar && window.innerWidth < NARROW_PX) bar.scrollIntoView();
}

/** @param {number | string} value */
export const severityText = (value) => Number(value).toFixed(2);

/** @param {string | null} title */
export function nameTab(title) {
  if (title) document.title = title;
}

const runButton = () => {
  const button = /** @type {HTMLButtonElement | null} */ (byId("run"));
  return button && !button.disabled ? button : null;
};

// A number field tells Dash its value when it loses the focus, and Dash takes a moment to hear it: let
// that be over first, or the flight is flown with the value before.
function run() {
  /** @type {HTMLElement | null} */ (document.activeElement)?.blur();
  setTimeout(() => runButton()?.click(), SETTLE_MS);
}

export function start() {
  schemeChanged.listen(reportScheme);
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) setProps("awake", { data: Date.now() });
  });
  onKeys({ when: () => runButton() !== null, always: true, keys: { "Mod+Enter": run } });
}
