// The presenter view: an address of its own puts Fly on the wall. Keys do the rest: P goes there and
// back, Space plays, arrows move the time cursor, F fills the screen, H hides what a class is to find,
// Escape leaves.

import { onKeys } from "../kit/keys.js";
import { around, byId, CONSTANTS, goTo } from "../kit/page.js";
import { scheme, schemeChanged, setScheme } from "../kit/theme.js";
import { here, move } from "./cursor.js";
import { flownUntil } from "./flight.js";

const STEP_S = 5;
const root = document.documentElement;

let before = "light"; // the theme that comes back afterwards

const presenting = () => "presenting" in root.dataset;
const onFly = () => byId("fly") !== null;

/** @param {boolean} on */
function put(on) {
  if (on === presenting()) return;
  if (on) {
    before = scheme();
    root.dataset.presenting = "";
    setScheme("dark");
  } else {
    delete root.dataset.presenting;
    setScheme(before);
    if (document.fullscreenElement) document.exitFullscreen();
  }
  byId("present")?.setAttribute("aria-pressed", String(on));
  window.dispatchEvent(new Event("resize"));
}

function toggle() {
  const { runPrefix, presentPrefix } = CONSTANTS;
  const [, , run] = location.pathname.split("/");
  if (presenting()) {
    if (location.pathname.startsWith(presentPrefix)) goTo(runPrefix + run);
    put(false);
  } else if (onFly()) {
    if (location.pathname.startsWith(runPrefix)) goTo(presentPrefix + run);
    put(true);
  }
}

/** @param {number} by_s */
const step = (by_s) => () => move(Math.min(Math.max(here() + by_s, 0), flownUntil()));

function fillScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else root.requestFullscreen?.();
}

/** @param {MouseEvent} event */
function press(event) {
  const target = /** @type {HTMLElement} */ (event.target);
  // Space is for playing now: pressed once more on the box it would show what is hidden.
  if (presenting() && target.id === "wall-hide" && event.detail > 0) target.blur();
  if (!around(event, "#present")) return;
  toggle();
  // Space is for playing now, not for this button.
  /** @type {HTMLElement | null} */ (document.activeElement)?.blur();
}

/**
 * Follows the address, and puts the channels that tell most first; returns whether it is this view's.
 * @param {string | null} path
 * @param {number[] | null} channels
 */
export function follow(path, channels) {
  if (onFly()) {
    (channels || []).forEach((index, order) => {
      /** @type {HTMLElement | null | undefined} */
      const tile = byId(`tile-${index}`)?.closest(".tile");
      if (!tile) return;
      tile.classList.add("on-wall");
      tile.style.setProperty("--wall-order", String(order));
    });
  }
  const wanted = (path || "").startsWith(CONSTANTS.presentPrefix);
  if (wanted || location.pathname !== "/") put(wanted);
  return wanted;
}

export function start() {
  // The wall is dark whatever Mantine remembers.
  schemeChanged.listen(() => {
    if (presenting() && scheme() !== "dark") setScheme("dark");
  });
  document.addEventListener("click", press);
  onKeys({ when: onFly, keys: { p: toggle } });
  onKeys({ when: presenting, always: true, keys: { Escape: toggle } });
  onKeys({
    when: presenting,
    keys: {
      p: toggle,
      f: fillScreen,
      h: () => byId("wall-hide")?.click(),
      " ": () => byId("play")?.click(),
      ArrowRight: step(STEP_S),
      ArrowLeft: step(-STEP_S),
    },
  });
}
