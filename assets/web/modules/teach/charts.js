// The charts of a mystery flight: one line a sensor, the mirror beside it once the server sends it.
// A click, or Enter at the cursor, asks which way the channel goes. Nothing here knows more than what
// is drawn.

import { onKeys } from "../kit/keys.js";
import { number } from "../kit/numbers.js";
import { byId } from "../kit/page.js";
import {
  commonOptions,
  drawMoment,
  drawOn,
  line,
  padded,
  redraw,
  takeSelection,
  timeAxis,
  valueAxis,
  watchWidth,
  widthOf,
} from "../kit/plot.js";
import { unpacked } from "../kit/samples.js";
import { colour, schemeChanged } from "../kit/theme.js";
import { clock } from "../kit/time.js";
import { closeMenu, openMenu } from "./menu.js";

const HEIGHT = 104;
const STEP_S = 5;
const PAGE_S = 30;

/** @type {Record<string, string>} */
const ARROWS = { "+": "▲", "-": "▼" };

/**
 * @typedef {import("../kit/plot.js").Span} Span
 * @typedef {import("../fly/flight.js").Spec} Spec
 * @typedef {{ index: number, time_s: number, direction: string }} Mark
 * @typedef {object} MysteryFlight as `app/figures/mystery.py` sends it
 * @property {Spec[]} specs
 * @property {number} duration_s
 * @property {number | null} onset_s
 * @property {string[][]} channels
 */

/** @type {Chart[]} */
let charts = [];
/** @type {MysteryFlight} */
let flight = { specs: [], duration_s: 0, onset_s: null, channels: [] };
/** @type {Mark[]} */
let marks = [];
/** @type {Span | null} */
let zoom = null;

const isOver = () => byId("mystery")?.dataset.over === "yes";

const span = () => zoom ?? { min: 0, max: flight.duration_s };

// ---- one chart ------------------------------------------------------------------------------

class Chart {
  /**
   * @param {HTMLElement} root
   * @param {number} index
   */
  constructor(root, index) {
    this.root = root;
    this.index = index;
    this.spec = flight.specs[index];
    this.readout = byId(`mystery-readout-${index}`);
    this.dragged = false;
    root.replaceChildren();
    this.plot = new uPlot(this.options(widthOf(root)), [[], [], []], root);
    this.plot.over.addEventListener("click", (event) => this.click(event));
    root.onblur = () => this.plot.setCursor({ left: -10, top: 0 });
    this.resizing = watchWidth(root, (width) => this.plot.setSize({ width, height: HEIGHT }));
  }

  /**
   * @param {number} width
   * @returns {uPlot.Options}
   */
  options(width) {
    return {
      ...commonOptions(width, HEIGHT, [6, 14, 0, 0], {
        sync: {
          key: "mystery",
          filters: { pub: (type) => type.startsWith("mousemove"), sub: () => true },
        },
        bind: {
          dblclick: () => () => {
            zoomTo(null);
            return null;
          },
        },
      }),
      axes: [timeAxis(true), valueAxis(26)],
      scales: {
        x: { time: false },
        y: { range: (plot, low, high) => padded(low, high, this.centre(plot), this.spec.quiet) },
      },
      series: [{}, line("--mirror", 3), line("--faulted", 1.4)],
      hooks: {
        draw: [() => this.drawMarks()],
        setSelect: [() => this.select()],
        setCursor: [() => this.read()],
      },
    };
  }

  /** @param {uPlot} plot */
  centre(plot) {
    return plot.data[2]?.[0] ?? this.spec.resting;
  }

  draw() {
    const [time, sensor, mirror] = unpacked([flight.channels[this.index]])[0];
    this.plot.batch(() => {
      this.plot.setData([time, mirror ?? time.map(() => null), sensor], true);
      this.plot.setScale("x", span());
    });
    this.root.dataset.samples = String(time.length);
    this.root.setAttribute("aria-valuemax", String(flight.duration_s));
    this.read();
  }

  read() {
    if (!this.readout || !this.plot) return;
    const sensor = this.plot.data[2];
    const reading = sensor[this.plot.cursor.idx ?? sensor.length - 1];
    if (reading === undefined || reading === null) return;
    this.readout.textContent = number(reading, this.spec.decimals);
    const text = `${clock(this.time())}: ${this.readout.textContent} ${this.spec.unit}`;
    this.root.setAttribute("aria-valuenow", String(Math.round(this.time())));
    this.root.setAttribute("aria-valuetext", text);
  }

  /** The moment at the cursor. */
  time() {
    const left = this.plot.cursor.left ?? -1;
    return left >= 0 ? this.plot.posToVal(left, "x") : 0;
  }

  /** @param {number} time_s */
  moveTo(time_s) {
    const bounded = Math.min(Math.max(time_s, 0), flight.duration_s);
    if (zoom && (bounded < zoom.min || bounded > zoom.max)) zoomTo(null);
    this.plot.setCursor({ left: this.plot.valToPos(bounded, "x"), top: 1 });
  }

  select() {
    // The click that ends a drag marks nothing.
    const selected = takeSelection(this.plot);
    this.dragged = selected !== null;
    setTimeout(() => {
      this.dragged = false;
    });
    if (selected) zoomTo(selected);
  }

  /** @param {MouseEvent} event */
  click(event) {
    if (this.dragged || isOver()) return;
    const time_s = Math.max(0, this.plot.posToVal(event.offsetX, "x"));
    openMenu(this.root, time_s, event.clientX, event.clientY);
  }

  askAtCursor() {
    if (isOver()) return;
    const box = this.plot.over.getBoundingClientRect();
    const x = box.left + Math.max(0, this.plot.cursor.left ?? 0);
    openMenu(this.root, this.time(), x, box.top + 30);
  }

  drawMarks() {
    drawMoment(this.plot, flight.onset_s, "--onset", [3, 3]);
    for (const mark of marks) if (mark.index === this.index) this.drawMark(mark);
  }

  /** @param {Mark} mark */
  drawMark({ time_s, direction }) {
    const x = drawMoment(this.plot, time_s, "--ink", []);
    if (x === null) return;
    drawOn(this.plot, (ctx) => {
      ctx.fillStyle = colour("--ink");
      ctx.font = `${11 * devicePixelRatio}px sans-serif`;
      const top = this.plot.bbox.top + 11 * devicePixelRatio;
      ctx.fillText(ARROWS[direction], x + 3 * devicePixelRatio, top);
    });
  }

  destroy() {
    this.resizing.disconnect();
    this.plot.destroy();
  }
}

// ---- all charts -----------------------------------------------------------------------------

/** @param {Span | null} to */
function zoomTo(to) {
  zoom = to;
  for (const chart of charts) chart.plot.setScale("x", span());
}

function build() {
  if (charts.length && charts.every((chart) => chart.root.isConnected)) return;
  for (const chart of charts) chart.destroy();
  zoom = null;
  charts = flight.specs.map((_, index) => {
    return new Chart(/** @type {HTMLElement} */ (byId(`mystery-${index}`)), index);
  });
}

/**
 * Draws a flight with what has been marked in it; returns how many charts there are.
 * @param {MysteryFlight | null} sent
 * @param {Mark[] | null} marked
 */
export function draw(sent, marked) {
  if (!sent || !byId("mystery-0")) return 0;
  const isAnother = sent !== flight;
  flight = sent;
  marks = marked || [];
  closeMenu();
  build();
  for (const chart of charts) {
    if (isAnother) chart.draw();
    else redraw(chart.plot);
  }
  return charts.length;
}

/** @param {(chart: Chart) => void} act */
const onChart = (act) => (/** @type {Event} */ _, /** @type {HTMLElement | null} */ root) => {
  const chart = charts.find((one) => one.root === root);
  if (chart) act(chart);
};

const step = (/** @type {number} */ by_s) => onChart((chart) => chart.moveTo(chart.time() + by_s));

export function start() {
  schemeChanged.listen(() => {
    for (const chart of charts) redraw(chart.plot);
  });
  const ask = onChart((chart) => chart.askAtCursor());
  onKeys({
    within: ".mystery-chart",
    keys: {
      ArrowLeft: step(-STEP_S),
      ArrowRight: step(STEP_S),
      ArrowDown: step(-STEP_S),
      ArrowUp: step(STEP_S),
      PageDown: step(-PAGE_S),
      PageUp: step(PAGE_S),
      Home: step(-Infinity),
      End: step(Infinity),
      Enter: ask,
      " ": ask,
    },
  });
}
