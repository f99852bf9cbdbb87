// The buttons and keys of the time cursor, of A and B, and of the zoom.

import { onKeys } from "../kit/keys.js";
import { around, byId } from "../kit/page.js";
import { a_s, b_s, setBetween } from "./between.js";
import { here, isPlaying, move, play, stop } from "./cursor.js";
import { panBy, zoomBy, zoomTo } from "./zoom.js";

const ZOOM_STEP = 0.5;
const PAN_STEP = 0.25;

/** @type {Record<string, () => void>} */
const BUTTONS = {
  play: () => (isPlaying() ? stop() : play()),
  "set-a": () => setBetween(here(), b_s),
  "set-b": () => setBetween(a_s, here()),
  "between-clear": () => setBetween(null, null),
  "zoom-out": () => zoomTo(null),
};

/** @param {MouseEvent} event */
function press(event) {
  const button = around(event, "button");
  if (!button) return;
  if (Object.hasOwn(BUTTONS, button.id)) BUTTONS[button.id]();
  if (button.matches(".moment-button")) move(Number(button.dataset.timeS));
  if (button.matches("#run, #again, #retry") && isPlaying()) stop();
}

export function start() {
  document.addEventListener("click", press);
  onKeys({
    when: () => byId("scrub") !== null,
    shared: true,
    keys: {
      a: BUTTONS["set-a"],
      b: BUTTONS["set-b"],
      "+": () => zoomBy(ZOOM_STEP),
      "=": () => zoomBy(ZOOM_STEP),
      "-": () => zoomBy(1 / ZOOM_STEP),
      0: () => zoomTo(null),
      "<": () => panBy(-PAN_STEP),
      ">": () => panBy(PAN_STEP),
      Escape: () => (a_s === null && b_s === null ? move(null) : setBetween(null, null)),
    },
  });
}
