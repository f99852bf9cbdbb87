// The part of the flight that all charts show.

import { byId } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { cursorMoved, flightReplaced, zoomChanged } from "./changes.js";
import { cursor_s } from "./cursor.js";
import { flight } from "./flight.js";

const LEAST_SPAN_S = 2;

/** @typedef {import("../kit/plot.js").Span} Span */

/** @type {Span | null} null: the whole flight */
export let zoom = null;

/** @returns {Span} */
export const span = () => zoom ?? { min: 0, max: flight.duration_s };

/** @param {Span | null} to */
export function zoomTo(to) {
  const end_s = flight.duration_s;
  const min = to ? Math.max(0, to.min) : 0;
  const max = to ? Math.min(end_s, Math.max(to.max, min + LEAST_SPAN_S)) : end_s;
  zoom = max - min < end_s - 0.5 ? { min, max } : null;
  zoomChanged.send(zoom);
  showZoomOut();
}

/**
 * Shows as much from another moment on.
 * @param {number} min
 */
export function panTo(min) {
  if (!zoom) return;
  const width = zoom.max - zoom.min;
  const from = Math.min(Math.max(0, min), flight.duration_s - width);
  zoomTo({ min: from, max: from + width });
}

/**
 * Goes on or back by a share of what is shown.
 * @param {number} share
 */
export function panBy(share) {
  if (zoom) panTo(zoom.min + share * (zoom.max - zoom.min));
}

/**
 * Around the cursor, or around the middle of what is shown.
 * @param {number} factor
 */
export function zoomBy(factor) {
  const { min, max } = span();
  const at_s = cursor_s ?? -1;
  const around = at_s >= min && at_s <= max ? at_s : (min + max) / 2;
  zoomTo({ min: around - (around - min) * factor, max: around + (max - around) * factor });
}

function showZoomOut() {
  const button = byId("zoom-out");
  if (!button) return;
  button.hidden = zoom === null;
  button.textContent = zoom ? `${clock(zoom.min)} to ${clock(zoom.max)}  ✕` : "";
}

export function start() {
  cursorMoved.listen((at_s) => {
    if (zoom && at_s !== null && (at_s < zoom.min || at_s > zoom.max)) zoomTo(null);
  });
  flightReplaced.listen(() => {
    zoom = null;
    showZoomOut();
  });
}
