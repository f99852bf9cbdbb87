// The page of a mystery flight beside its charts: the clock, and taking marks away again.

import { around, byId } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { report } from "./menu.js";

const TICK_MS = 1000;
const NAME_BYTES = 16;

/** @type {{ shown: HTMLElement, since_ms: number } | null} */
let ticking = null;

function tick() {
  const shown = byId("mystery-clock");
  if (!shown) return;
  if (ticking?.shown !== shown) {
    const since_ms = performance.now() - 1000 * Number(shown.dataset.elapsed);
    ticking = { shown, since_ms };
  }
  shown.textContent = clock((performance.now() - ticking.since_ms) / 1000);
}

/**
 * A name for this browser, so that it finds its own flights again.
 * @param {number} _ when it was stored
 * @param {string | null} known
 */
export function learner(_, known) {
  if (known) return known;
  const bytes = crypto.getRandomValues(new Uint8Array(NAME_BYTES));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

export function start() {
  setInterval(tick, TICK_MS);
  document.addEventListener("click", (event) => {
    const button = around(event, ".mark-remove");
    if (button) report({ channel: button.dataset.channel, direction: null });
  });
}
