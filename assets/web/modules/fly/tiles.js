// The channel tiles: both flights above, their residual below, drawn by uPlot on canvas.
//
// One cursor and one zoom serve all tiles (`cursor.js`, `zoom.js`); the samples are in `flight.js`.
// Tiles in view are drawn at once, the others as soon as the browser has nothing better to do.

import { number, signed } from "../kit/numbers.js";
import { byId, write } from "../kit/page.js";
import {
  commonOptions,
  drawLevel,
  drawMoment,
  drawOn,
  line,
  padded,
  redraw as redrawPlot,
  takeSelection,
  timeAxis,
  valueAxis,
  watchWidth,
  widthOf,
} from "../kit/plot.js";
import { colour, schemeChanged } from "../kit/theme.js";
import { a_s, b_s } from "./between.js";
import {
  betweenChanged,
  cursorMoved,
  flightChanged,
  flightRefined,
  flightReplaced,
  marksChanged,
  unitsChanged,
  zoomChanged,
} from "./changes.js";
import { cursor_s, point } from "./cursor.js";
import { at, flight, flownUntil, mean, rows, take } from "./flight.js";
import { marks } from "./marks.js";
import { shown, takeSpecs } from "./units.js";
import { panTo, span, zoom, zoomTo } from "./zoom.js";

/**
 * @typedef {import("./changes.js").Mark} Mark
 * @typedef {import("./flight.js").Message} Message
 * @typedef {import("./flight.js").Spec} Spec
 */

const SENSOR_HEIGHT = 90;
const RESIDUAL_HEIGHT = 62;
const LEAST_IDLE_MS = 4;

/** @type {Tile[]} */
let tiles = [];

// ---- one tile -------------------------------------------------------------------------------

class Tile {
  /**
   * @param {HTMLElement} root
   * @param {Spec} spec
   * @param {number} index
   */
  constructor(root, spec, index) {
    this.root = root;
    this.spec = spec;
    this.index = index;
    this.readout = byId(`readout-${index}`);
    this.between = byId(`between-${index}`);
    this.unit = root.closest(".tile")?.querySelector(".tile-unit");
    root.replaceChildren();
    const width = widthOf(root);
    this.sensor = new uPlot(this.sensorOptions(width), [[], [], []], root);
    this.residual = new uPlot(this.residualOptions(width), [[], []], root);
    this.plots = [this.sensor, this.residual];
    this.plots.forEach(listen);
    this.resizing = watchWidth(root, (to) => this.fit(to));
    this.stale = false;
    this.inView = true;
    this.seeing = new IntersectionObserver((sightings) => {
      this.inView = sightings[sightings.length - 1].isIntersecting;
      if (!this.inView) return;
      if (this.stale) this.draw();
      else this.showCursor();
    });
    this.seeing.observe(root);
  }

  /**
   * @param {number} width
   * @returns {uPlot.Options}
   */
  sensorOptions(width) {
    return {
      ...commonOptions(width, SENSOR_HEIGHT, [4, 16, 6, 0], CURSOR),
      axes: [timeAxis(false), valueAxis(26)],
      scales: {
        x: { time: false },
        y: {
          range: (_, low, high) => {
            const { value, difference } = shown(this.spec);
            return padded(low, high, value(this.centre()), difference(this.spec.quiet));
          },
        },
      },
      series: [{}, line("--mirror", 3), line("--faulted", 1.3)],
      hooks: {
        draw: [(plot) => this.drawLimits(plot), (plot) => this.drawMoments(plot)],
        setSelect: [zoomToSelection],
      },
    };
  }

  /**
   * @param {number} width
   * @returns {uPlot.Options}
   */
  residualOptions(width) {
    return {
      ...commonOptions(width, RESIDUAL_HEIGHT, [4, 16, 0, 0], CURSOR),
      axes: [timeAxis(true), valueAxis(14)],
      scales: {
        x: { time: false },
        y: {
          range: (_, low, high) =>
            padded(low, high, 0, shown(this.spec).difference(this.spec.still)),
        },
      },
      series: [{}, line("--residual", 1.3)],
      hooks: { draw: [(plot) => this.drawMoments(plot)], setSelect: [zoomToSelection] },
    };
  }

  /** The value that a quiet channel is centred on. */
  centre() {
    const mirror = rows(this.index)[2];
    return mirror.length ? mirror[0] : this.spec.resting;
  }

  draw() {
    this.stale = false;
    let [time, faulted, mirror] = rows(this.index);
    const { value, label, converted } = shown(this.spec);
    if (converted) [faulted, mirror] = [faulted.map(value), mirror.map(value)];
    const residual = faulted.map((reading, row) => reading - mirror[row]);
    this.show(this.sensor, [time, mirror, faulted]);
    this.show(this.residual, [time, residual]);
    this.root.dataset.samples = String(time.length);
    if (this.unit) write(this.unit, label);
    this.showCursor();
    this.showBetween();
  }

  /**
   * @param {uPlot} plot
   * @param {uPlot.AlignedData} data
   */
  show(plot, data) {
    plot.batch(() => {
      plot.setData(data, true);
      plot.setScale("x", span());
    });
  }

  /** The line at the cursor and the reading there; without one, the latest reading. */
  showCursor() {
    this.showReading();
    for (const plot of this.plots) {
      if (plot.over.matches(":hover")) continue;
      const left = cursor_s === null ? -10 : plot.valToPos(cursor_s, "x");
      if (Math.abs(left - (plot.cursor.left ?? -10)) > 0.1) {
        plot.setCursor({ left, top: 1 }, false);
      }
    }
    this.root.dataset.cursorS = cursor_s === null ? "" : String(cursor_s);
  }

  showReading() {
    if (!this.readout) return;
    const { difference, value, decimals } = shown(this.spec);
    const read = at(this.index, cursor_s);
    this.readout.textContent = read
      ? `${number(value(read.faulted), decimals)}  Δ ` +
        signed(difference(read.faulted - read.mirror), decimals)
      : "";
  }

  /** How far and how fast the reading goes from A to B. */
  showBetween() {
    if (!this.between) return;
    if (a_s === null || b_s === null || a_s === b_s || b_s > flownUntil() + 1) {
      this.between.textContent = "";
      return;
    }
    const [a, b] = [mean(this.index, a_s), mean(this.index, b_s)];
    if (!a || !b) return;
    const { difference, decimals } = shown(this.spec);
    const gone = difference(b.faulted - a.faulted);
    const perMinute = (60 * gone) / (b_s - a_s);
    this.between.textContent = `A→B ${signed(gone, decimals)}  ${signed(perMinute, decimals + 1)}/min`;
  }

  /** @param {uPlot} plot */
  drawLimits(plot) {
    const { value } = shown(this.spec);
    for (const limit of this.spec.limits.map(value)) drawLevel(plot, limit, "--bad");
  }

  /**
   * Onset, first evidence, first right answer; where this channel is beyond its limits; A and B.
   * @param {uPlot} plot
   */
  drawMoments(plot) {
    for (const mark of marks) {
      if (mark.kind === "onset") drawMoment(plot, mark.time_s, "--onset", [3, 3]);
      else if (mark.kind !== "limit") drawFlag(plot, mark);
      else if (mark.channel === this.spec.name) drawExcess(plot, mark);
    }
    for (const time_s of [a_s, b_s]) drawMoment(plot, time_s, "--ink", []);
  }

  /** @param {number} width */
  fit(width) {
    if (width === this.sensor.width) return;
    this.sensor.setSize({ width, height: SENSOR_HEIGHT });
    this.residual.setSize({ width, height: RESIDUAL_HEIGHT });
  }

  destroy() {
    this.resizing.disconnect();
    this.seeing.disconnect();
    for (const plot of this.plots) plot.destroy();
  }
}

// ---- marks ----------------------------------------------------------------------------------

/**
 * A small flag at the top: these moments are the whole flight's, not this channel's.
 * @param {uPlot} plot
 * @param {Mark} mark
 */
function drawFlag(plot, { kind, time_s }) {
  const x = plot.valToPos(time_s, "x", true);
  const { left, top, width } = plot.bbox;
  if (x < left || x > left + width) return;
  const side = 3.5 * devicePixelRatio;
  drawOn(plot, (ctx) => {
    ctx.fillStyle = colour(`--mark-${kind}`);
    ctx.beginPath();
    ctx.moveTo(x - side, top);
    ctx.lineTo(x + side, top);
    ctx.lineTo(x, top + 2 * side);
    ctx.fill();
  });
}

/**
 * A red bar along the foot of the plot for as long as the limit was exceeded.
 * @param {uPlot} plot
 * @param {Mark} mark
 */
function drawExcess(plot, { time_s, end_s = time_s }) {
  const { left, top, width, height } = plot.bbox;
  const inside = (/** @type {number} */ x) => Math.min(Math.max(x, left), left + width);
  const [from, to] = [time_s, end_s].map((at_s) => inside(plot.valToPos(at_s, "x", true)));
  if (to <= left || from >= left + width) return;
  const thick = 3 * devicePixelRatio;
  drawOn(plot, (ctx) => {
    ctx.fillStyle = colour("--bad");
    ctx.fillRect(from, top + height - thick, Math.max(to - from, 2 * devicePixelRatio), thick);
  });
}

// ---- pointer --------------------------------------------------------------------------------

/** @type {uPlot.Cursor} */
const CURSOR = {
  bind: {
    dblclick: () => () => {
      zoomTo(null);
      return null;
    },
    mousedown: (plot, _, drag) => (event) => (event.shiftKey ? pan(plot, event) : drag(event)),
  },
};

/**
 * The plot that the pointer is over speaks for all.
 * @param {uPlot} plot
 */
function listen(plot) {
  plot.over.addEventListener("mousemove", (event) => {
    if (plot.data[0].length) point(plot.posToVal(event.clientX - plot.rect.left, "x"));
  });
  plot.over.addEventListener("mouseleave", () => point(null));
}

/** @param {uPlot} plot */
function zoomToSelection(plot) {
  const selected = takeSelection(plot);
  if (selected) zoomTo(selected);
}

/**
 * Shift and drag: the zoomed span goes with the pointer.
 * @param {uPlot} plot
 * @param {MouseEvent} event
 */
function pan(plot, event) {
  if (!zoom || event.button !== 0) return null;
  const { min, max } = zoom;
  const perPixel = (max - min) / plot.over.clientWidth;
  const follow = (/** @type {MouseEvent} */ moved) =>
    panTo(min - (moved.clientX - event.clientX) * perPixel);
  document.addEventListener("mousemove", follow);
  const release = () => document.removeEventListener("mousemove", follow);
  document.addEventListener("mouseup", release, { once: true });
  return null;
}

// ---- all tiles ------------------------------------------------------------------------------

/** @param {Spec[]} specs */
function build(specs) {
  if (tiles.length && tiles.every((tile) => tile.root.isConnected)) return;
  for (const tile of tiles) tile.destroy();
  takeSpecs(specs);
  tiles = specs.map((spec, index) => {
    return new Tile(/** @type {HTMLElement} */ (byId(`tile-${index}`)), spec, index);
  });
}

/**
 * What is in view changes at once, the rest when the browser has time.
 * @param {(tile: Tile) => void} change
 */
function redraw(change) {
  for (const tile of tiles) {
    if (tile.inView && !tile.stale) change(tile);
    else tile.stale = true;
  }
  drawStaleWhenIdle();
}

/** @type {number | null} */
let idle = null;

function drawStaleWhenIdle() {
  if (idle !== null || !tiles.some((tile) => tile.stale)) return;
  const drawSome = (/** @type {IdleDeadline} */ deadline) => {
    idle = null;
    for (const tile of tiles) {
      if (!tile.stale) continue;
      tile.draw();
      if (deadline.timeRemaining() < LEAST_IDLE_MS) break;
    }
    drawStaleWhenIdle();
  };
  idle = requestIdleCallback(drawSome, { timeout: 500 });
}

/**
 * Draws a message and returns how much of which flight the page now holds.
 * @param {Message | null} message
 * @param {Spec[] | null} specs
 */
export function showFlight(message, specs) {
  if (!message || !specs || !byId("tile-0")) return { key: null, count: 0 };
  const planned_s = flight.duration_s;
  const begins = take(message);
  build(specs);
  for (const tile of tiles) tile.stale = true;
  if (begins) flightReplaced.send();
  else if (flight.duration_s !== planned_s) zoomTo(null);
  for (const tile of tiles) if (tile.inView) tile.draw();
  drawStaleWhenIdle();
  flightChanged.send();
  return { key: flight.key, count: flight.count };
}

const redrawPlots = () => redraw((tile) => tile.plots.forEach(redrawPlot));
const drawAgain = () => redraw((tile) => tile.draw());

function showCursor() {
  for (const tile of tiles) {
    if (tile.inView && !tile.stale) tile.showCursor();
    else tile.showReading();
  }
}

function showBetween() {
  for (const tile of tiles) tile.showBetween();
  redrawPlots();
}

function showZoom() {
  redraw((tile) => {
    for (const plot of tile.plots) plot.setScale("x", span());
  });
}

export function start() {
  cursorMoved.listen(showCursor);
  zoomChanged.listen(showZoom);
  marksChanged.listen(redrawPlots);
  betweenChanged.listen(showBetween);
  flightRefined.listen(drawAgain);
  unitsChanged.listen(drawAgain);
  schemeChanged.listen(redrawPlots);
}
