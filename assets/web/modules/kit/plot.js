// What all uPlot charts share: axes of time and value, lines, ranges, marks, zooming by dragging.

import { number } from "./numbers.js";
import { colour } from "./theme.js";
import { clock } from "./time.js";

const AXIS_WIDTH = 46;
const TIME_AXIS_HEIGHT = 18;
const TIME_STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];
const MIN_ZOOM_PX = 4;
const LEAST_WIDTH_PX = 80;

/**
 * @typedef {{ min: number, max: number }} Span
 * @typedef {[number, number]} Point
 */

/** @param {HTMLElement} root */
export const widthOf = (root) => Math.max(root.clientWidth, LEAST_WIDTH_PX);

/**
 * Calls `fit` with the width of an element whenever it has another.
 * @param {HTMLElement} root
 * @param {(width: number) => void} fit
 */
export function watchWidth(root, fit) {
  const resizing = new ResizeObserver(() => {
    if (root.clientWidth >= LEAST_WIDTH_PX) fit(root.clientWidth);
  });
  resizing.observe(root);
  return resizing;
}

/**
 * @param {number} width
 * @param {number} height
 * @param {[number, number, number, number]} padding
 * @param {uPlot.Cursor} cursor what else the cursor does
 */
export function commonOptions(width, height, padding, cursor) {
  return {
    width,
    height,
    padding,
    legend: { show: false },
    cursor: {
      y: false,
      points: { size: 5 },
      drag: { x: true, y: false, setScale: false },
      ...cursor,
    },
  };
}

/**
 * @param {boolean} labelled
 * @returns {uPlot.Axis}
 */
export function timeAxis(labelled) {
  return {
    ...plainAxis(),
    size: labelled ? TIME_AXIS_HEIGHT : 0,
    gap: 3,
    space: 56,
    incrs: TIME_STEPS_S,
    values: (_, splits) => splits.map((time_s) => (labelled ? clock(time_s) : "")),
  };
}

/**
 * @param {number} space pixels between two of its labels, at least
 * @returns {uPlot.Axis}
 */
export function valueAxis(space) {
  return {
    ...plainAxis(),
    size: AXIS_WIDTH,
    gap: 4,
    space,
    values: (_, splits) => splits.map((value) => tickLabel(value, splits)),
  };
}

/** @returns {uPlot.Axis} */
function plainAxis() {
  return {
    font: `10px ${getComputedStyle(document.body).fontFamily}`,
    stroke: () => colour("--ink-2"),
    grid: { stroke: () => colour("--grid"), width: 1 },
    ticks: { show: false },
  };
}

/**
 * A label of an axis, with the digits that tell it from its neighbours.
 * @param {number} value
 * @param {number[]} splits
 */
export function tickLabel(value, splits) {
  const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) : Math.abs(value) || 1;
  return number(value, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

/**
 * @param {string} variable
 * @param {number} width
 * @returns {uPlot.Series}
 */
export function line(variable, width) {
  return { stroke: () => colour(variable), width, points: { show: false } };
}

/**
 * The range of the data, but never so narrow that mere noise fills the chart.
 * @param {number | null} low
 * @param {number | null} high
 * @param {number} centre
 * @param {number} span
 * @returns {Point}
 */
export function padded(low, high, centre, span) {
  const from = Math.min(low ?? centre, centre - span);
  const to = Math.max(high ?? centre, centre + span);
  const margin = 0.06 * (to - from);
  return [from - margin, to + margin];
}

/**
 * The span that has been dragged over, null for one too narrow to be meant.
 * @param {uPlot} plot
 * @returns {Span | null}
 */
export function takeSelection(plot) {
  const { left, width } = plot.select;
  if (width < MIN_ZOOM_PX) return null;
  plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  return { min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") };
}

/** @param {uPlot} plot */
export const redraw = (plot) => plot.redraw(false, true);

/**
 * An upright line at a moment; returns where it is, null for a moment that is not shown.
 * @param {uPlot} plot
 * @param {number | null} time_s
 * @param {string} variable
 * @param {number[]} dash
 */
export function drawMoment(plot, time_s, variable, dash) {
  if (time_s === null) return null;
  const x = Math.round(plot.valToPos(time_s, "x", true)) + 0.5;
  const { left, top, width, height } = plot.bbox;
  if (x < left || x > left + width) return null;
  drawLine(plot, variable, dash, [x, top], [x, top + height]);
  return x;
}

/**
 * A line across the plot at a value, where it is shown.
 * @param {uPlot} plot
 * @param {number} value
 * @param {string} variable
 */
export function drawLevel(plot, value, variable) {
  const { min = Infinity, max = -Infinity } = plot.scales.y;
  if (value < min || value > max) return;
  const y = Math.round(plot.valToPos(value, "y", true)) + 0.5;
  drawLine(plot, variable, [], [plot.bbox.left, y], [plot.bbox.left + plot.bbox.width, y]);
}

/**
 * @param {uPlot} plot
 * @param {(ctx: CanvasRenderingContext2D) => void} draw
 */
export function drawOn({ ctx }, draw) {
  ctx.save();
  draw(ctx);
  ctx.restore();
}

/**
 * @param {uPlot} plot
 * @param {string} variable
 * @param {number[]} dash
 * @param {Point} from
 * @param {Point} to
 */
function drawLine(plot, variable, dash, from, to) {
  drawOn(plot, (ctx) => {
    ctx.strokeStyle = colour(variable);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(dash.map((length) => length * devicePixelRatio));
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(...to);
    ctx.stroke();
  });
}
