// The menu in which somebody says which way a channel goes from a moment on.

import { onKeys } from "../kit/keys.js";
import { make, setProps } from "../kit/page.js";
import { place } from "../kit/popover.js";
import { clock } from "../kit/time.js";

/** @type {[direction: string, label: string][]} */
const CHOICES = [
  ["+", "▲ rises"],
  ["-", "▼ falls"],
];
const OFFSET_PX = 6;

/** @type {HTMLElement | null} */
let menu = null;
/** @type {HTMLElement | null} the chart that it is of */
let chart = null;

/**
 * Reports a mark, or the removal of one (direction null). `at` makes the same mark twice two reports.
 * @param {{ channel?: string, time_s?: number, direction: string | null }} claim
 */
export const report = (claim) => setProps("mystery-mark", { data: { ...claim, at: Date.now() } });

/**
 * @param {HTMLElement} root the chart
 * @param {number} time_s
 * @param {number} x
 * @param {number} y
 */
export function openMenu(root, time_s, x, y) {
  closeMenu();
  const { channel, label } = root.dataset;
  chart = root;
  menu = make("div", "mark-menu panel", document.body);
  menu.setAttribute("role", "dialog");
  menu.setAttribute("aria-label", `Mark ${label} at ${clock(time_s)}`);
  make("p", "", menu, `${label} from ${clock(time_s)}`);
  for (const [direction, word] of CHOICES) {
    const button = make("button", "", menu, word);
    button.setAttribute("type", "button");
    button.addEventListener("click", () => {
      report({ channel, time_s, direction });
      leaveMenu();
    });
  }
  const top = y + OFFSET_PX;
  place(menu, { left: x, right: x, top, bottom: top }, ["right", "left"], OFFSET_PX);
  menu.querySelector("button")?.focus();
}

export function closeMenu() {
  if (menu) menu.remove();
  menu = null;
}

function leaveMenu() {
  closeMenu();
  chart?.focus();
}

function toNext() {
  if (!menu) return;
  const buttons = menu.querySelectorAll("button");
  const at = [...buttons].findIndex((button) => button.matches(":focus"));
  buttons[(at + 1) % buttons.length].focus();
}

export function start() {
  document.addEventListener("pointerdown", (event) => {
    if (menu && !menu.contains(/** @type {Node} */ (event.target))) closeMenu();
  });
  const arrows = { ArrowLeft: toNext, ArrowRight: toNext, ArrowUp: toNext, ArrowDown: toNext };
  onKeys({ within: ".mark-menu", keys: { ...arrows, Escape: leaveMenu } });
}
