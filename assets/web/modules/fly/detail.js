// Finer samples of the part of a flight that is zoomed into: what the page holds of the whole is
// thinned for the width of a screen. `app/pages/fly/detail.py` answers; a request is as heavy as the
// whole view at most, however long the part. Only the newest zoom is asked about, and once it rests.

import { flightChanged, flightRefined, zoomChanged } from "./changes.js";
import { flight, flownUntil, refine, WHOLE } from "./flight.js";

const REST_MS = 120;
const GROWING_MS = 1000;
const MARGIN = 0.25; // to either side, as a share of what is shown: panning begins with what is there
const LOOSE = 2; // held samples do for a zoom that is narrower by this factor at most

/**
 * @typedef {import("../kit/plot.js").Span} Span
 * @typedef {Span & { key: string | null, isWhole: boolean, is_exact: boolean, until_s: number }} Part
 */

/** @type {Span | null} */
let zoom = null;
/** @type {Part | null} the part that is drawn finer */
let held = null;
/** @type {AbortController | null} aborts the request that is under way */
let asking = null;
/** @type {ReturnType<typeof setTimeout> | null} */
let due = null;

function cancel() {
  if (due !== null) clearTimeout(due);
  if (asking) asking.abort();
  due = asking = null;
}

const isWhole = () => flight.count === WHOLE;

/** @param {Span} shown */
function isHeld(shown) {
  if (!held || held.key !== flight.key || held.isWhole !== isWhole()) return false;
  const isAsFine = held.is_exact || held.max - held.min <= LOOSE * (shown.max - shown.min);
  const hasGrown = Math.min(flownUntil(), shown.max) > held.until_s + 0.5;
  return isAsFine && !hasGrown && held.min <= shown.min && shown.max <= held.max;
}

async function ask() {
  due = null;
  const { key, run, duration_s } = flight;
  if (!run || !zoom) return;
  const margin = MARGIN * (zoom.max - zoom.min);
  const min = Math.max(0, zoom.min - margin);
  const max = Math.min(duration_s, zoom.max + margin);
  const part = { key, min, max, isWhole: isWhole() };
  const own = new AbortController();
  asking = own;
  try {
    const address = `/runs/${run}/detail?from_s=${min.toFixed(3)}&to_s=${max.toFixed(3)}`;
    const answer = await fetch(address, { signal: own.signal });
    const { whole, ...rest } = answer.ok ? await answer.json() : {};
    if (whole && flight.key === key) {
      held = { ...part, ...rest };
      refine(whole);
      flightRefined.send();
    }
  } catch (error) {
    const { name, message } = /** @type {Error} */ (error);
    if (name !== "AbortError") console.warn("No finer samples:", message);
  } finally {
    if (asking === own) asking = null;
  }
}

/** @param {Span | null} to */
function follow(to) {
  zoom = to;
  cancel();
  if (zoom && !isHeld(zoom)) due = setTimeout(ask, REST_MS);
  if (zoom || !held) return;
  held = null;
  refine(null);
  flightRefined.send();
}

// The flight goes on, or has become whole, while a part of it is looked at.
function goOn() {
  if (zoom && !due && !asking && !isHeld(zoom)) due = setTimeout(ask, GROWING_MS);
}

export function start() {
  zoomChanged.listen(follow);
  flightChanged.listen(goOn);
}
