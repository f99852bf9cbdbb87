// The Plotly charts of the page Fly: the time cursor, A, B and the marks over them, and the zoom that
// they share with the tiles.

import { byId } from "../kit/page.js";
import { a_s, b_s } from "./between.js";
import {
  betweenChanged,
  cursorMoved,
  flightChanged,
  marksChanged,
  zoomChanged,
} from "./changes.js";
import { cursor_s, point } from "./cursor.js";
import { marks } from "./marks.js";
import { span, zoomTo } from "./zoom.js";

const CHARTS = ["probabilities", "residual-strip"];
const FOLLOW_MS = 80;
const AWAIT_MS = 200;

/** @typedef {ReturnType<typeof setTimeout>} Timer */

/** @type {Timer | undefined} */
let following;
/** @type {Timer | undefined} */
let awaiting;

/** Plots that we listen to. @type {WeakSet<Element>} */
const attended = new WeakSet();

/** Plots whose zoom we are setting. @type {WeakSet<Element>} */
const zooming = new WeakSet();

// The flight's time on Plotly's date axes: milliseconds inside, from midnight on, and dates as text
// outside (`moment` in `app/figures/axes.py`). Never numbers outside: those are in the local time.
const toInside = (/** @type {number} */ at_s) => 1000 * at_s;
const fromInside = (/** @type {number} */ ms) => ms / 1000;

/** @param {string} id */
function plotOf(id) {
  const plot = /** @type {any} */ (document.querySelector(`#${id} .js-plotly-plot`));
  return plot?._fullLayout?.xaxis ? plot : null;
}

const plots = () => CHARTS.map(plotOf).filter((plot) => plot !== null);

// The cursor, A and B, and the marks other than the onset, which the figure has itself.
function drawLines() {
  /** @type {[string, number | null][]} */
  const lines = [
    ["cursor", cursor_s],
    ["a", a_s],
    ["b", b_s],
  ];
  for (const mark of marks) if (mark.kind !== "onset") lines.push([mark.kind, mark.time_s]);
  for (const plot of plots()) placeLines(plot, lines);
}

/**
 * @param {any} plot
 * @param {[string, number | null][]} lines
 */
function placeLines(plot, lines) {
  let layer = plot.querySelector(".time-lines");
  if (!layer) {
    layer = document.createElement("div");
    layer.className = "time-lines";
    plot.append(layer);
  }
  while (layer.children.length > lines.length) layer.lastChild.remove();
  while (layer.children.length < lines.length) layer.append(document.createElement("div"));
  const { _size: size, xaxis } = plot._fullLayout;
  Object.assign(layer.style, {
    left: `${xaxis._offset}px`,
    top: `${size.t}px`,
    height: `${size.h}px`,
  });
  lines.forEach(([kind, at_s], place) => {
    const line = layer.children[place];
    const x = at_s === null ? Number.NaN : xaxis.l2p(toInside(at_s));
    line.className = `${kind}-line`;
    line.hidden = !(x >= 0 && x <= xaxis._length);
    if (!line.hidden) line.style.transform = `translateX(${x}px)`;
  });
}

// Plotly comes when it comes, perhaps after the flight; and the page may have been laid out again.
function listenToCharts() {
  clearTimeout(awaiting);
  if (!byId("scrub")) return;
  const ready = plots().filter((plot) => plot.on);
  for (const plot of ready) listenTo(plot);
  if (ready.length < CHARTS.length) awaiting = setTimeout(listenToCharts, AWAIT_MS);
}

/**
 * Plotly says where the pointer is by the trace under it, which a gap does not have.
 * @param {any} plot
 */
function listenTo(plot) {
  if (attended.has(plot)) return;
  attended.add(plot);
  plot.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    const { xaxis } = plot._fullLayout;
    const x = event.clientX - plot.getBoundingClientRect().left - xaxis._offset;
    if (!event.buttons && x >= 0 && x <= xaxis._length) point(fromInside(xaxis.p2l(x)));
  });
  plot.addEventListener("pointerleave", () => point(null));
  plot.on("plotly_relayout", (/** @type {object} */ change) => {
    const moved = Object.keys(change).some((name) => name.startsWith("xaxis.range"));
    if (moved && !zooming.has(plot)) zoomTo(spanOf(plot));
  });
  plot.on("plotly_doubleclick", () => zoomTo(null));
  // A new figure comes unzoomed; a zoom by hand is reported only after this. The page may have been
  // left by then, and with it the plot.
  plot.on("plotly_afterplot", () =>
    setTimeout(() => {
      if (!plot._fullLayout) return;
      followZoom(plot);
      drawLines();
    }),
  );
  followZoom(plot);
  drawLines();
}

/** @param {any} plot */
function spanOf(plot) {
  const { xaxis } = plot._fullLayout;
  const [min, max] = xaxis.range.map((/** @type {string} */ end) => fromInside(xaxis.r2l(end)));
  return { min, max };
}

/** @param {any} plot */
function followZoom(plot) {
  const { min, max } = span();
  const shown = spanOf(plot);
  if (zooming.has(plot) || Math.abs(shown.min - min) + Math.abs(shown.max - max) < 0.05) return;
  zooming.add(plot);
  const range = [min, max].map((at_s) => plot._fullLayout.xaxis.l2r(toInside(at_s)));
  window.Plotly.relayout(plot, { "xaxis.range": range }).finally(() => zooming.delete(plot));
}

// Drawing a Plotly chart again takes 40 ms: not at every step on the way.
function followSoon() {
  clearTimeout(following);
  following = setTimeout(() => plots().forEach(followZoom), FOLLOW_MS);
  drawLines();
}

export function start() {
  cursorMoved.listen(drawLines);
  betweenChanged.listen(drawLines);
  marksChanged.listen(drawLines);
  zoomChanged.listen(followSoon);
  flightChanged.listen(listenToCharts);
}
