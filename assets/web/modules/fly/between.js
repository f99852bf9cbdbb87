// The cursors A and B: what changes from the one to the other is shown by each channel.

import { byId } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { betweenChanged, flightReplaced } from "./changes.js";

/** @typedef {number | null} Moment */

/** @type {Moment} */
export let a_s = null;
/** @type {Moment} */
export let b_s = null;

/**
 * @param {Moment} to_a
 * @param {Moment} to_b
 */
export function setBetween(to_a, to_b) {
  [a_s, b_s] = [to_a, to_b];
  betweenChanged.send({ a_s, b_s });
  const shown = byId("between");
  const clear = byId("between-clear");
  if (!shown || !clear) return;
  const parts = [a_s === null ? "" : `A ${clock(a_s)}`, b_s === null ? "" : `B ${clock(b_s)}`];
  if (a_s !== null && b_s !== null) parts.push(`${clock(Math.abs(b_s - a_s))} apart`);
  shown.textContent = parts.filter(Boolean).join("  ");
  clear.hidden = a_s === null && b_s === null;
}

export function start() {
  flightReplaced.listen(() => setBetween(null, null));
}
