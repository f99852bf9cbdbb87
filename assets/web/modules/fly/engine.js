// The engine view: a flat four from above with EGT and CHT on each cylinder, and gauges beside it,
// read at the time cursor. What a gauge is, on which cylinder or in which group, comes from
// `app/figures/engine_view.py`, its colours from `engine.css`. It is drawn once a frame at most, and
// only what has changed.

import { beyond, shortList, statusOf } from "../kit/gauge.js";
import { number, signed } from "../kit/numbers.js";
import { byId, make, write } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { cursorMoved, flightChanged, unitsChanged } from "./changes.js";
import { cursor_s } from "./cursor.js";
import { bar, DIAL, dial, drawEngine, gaugesAt, svg } from "./engine_drawing.js";
import { at, flownUntil, specs } from "./flight.js";
import { shown } from "./units.js";

/**
 * @typedef {import("../kit/gauge.js").Scale} Scale
 * @typedef {import("./engine_drawing.js").Hands} Hands
 * @typedef {object} Gauge
 * @property {number} index of its channel
 * @property {import("./flight.js").Spec} spec
 * @property {Scale} scale
 * @property {HTMLElement | SVGElement} group
 * @property {Element} value
 * @property {Element} difference
 * @property {Hands} hands
 * @property {import("../kit/gauge.js").Status} status
 */

const WORDS = { limit: "beyond its limit", caution: "outside its green arc" };

/** @type {HTMLElement | null} */
let host = null;
/** @type {Gauge[]} */
let gauges = [];
let inView = true;
/** @type {number | null} */
let due = null;

// ---- drawing --------------------------------------------------------------------------------

/** The channels whose gauges have a form, in their order on the page. @param {string} form */
const channelsOf = (form) =>
  specs
    .map((spec, index) => ({ index, spec, scale: /** @type {Scale} */ (spec.gauge) }))
    .filter(({ scale }) => scale?.form === form)
    .sort((one, other) => one.scale.order - other.scale.order);

/**
 * @param {ReturnType<typeof channelsOf>[number]} channel
 * @param {Pick<Gauge, "group" | "value" | "difference" | "hands">} drawn
 */
function add(channel, drawn) {
  const { label } = channel.spec;
  const { low, high, cylinder, place } = channel.scale;
  const { group } = drawn;
  const where = place ? `${label}, cylinder ${cylinder}, ${place.side} ${place.row}` : label;
  group.setAttribute("role", "meter");
  group.setAttribute("aria-label", where);
  group.setAttribute("aria-valuemin", String(low));
  group.setAttribute("aria-valuemax", String(high));
  gauges.push({ ...channel, ...drawn, status: "normal" });
}

function engine() {
  const channels = channelsOf("cylinder");
  const { drawing, cylinders } = drawEngine(channels.map(({ scale }) => scale));
  for (const channel of channels) {
    const { title, cylinder } = channel.scale;
    add(channel, gaugesAt(drawing, cylinders[Number(cylinder)], title, channel.scale));
  }
  return drawing;
}

function tachometers() {
  return channelsOf("dial").map((channel) => {
    const group = make("div", "gauge-cell tachometer");
    const drawing = svg("svg", { viewBox: "0 0 168 112", "aria-hidden": "true" }, group);
    const hands = dial(drawing, channel.scale);
    const { x, y } = DIAL;
    const value = svg("text", { class: "dial-value", x, y: y + 4 }, drawing);
    const difference = svg("text", { class: "dial-difference", x, y: y + 19 }, drawing);
    svg("text", { class: "dial-name", x, y: y + 36 }, drawing, channel.spec.label);
    add(channel, { group, value, difference, hands });
    return group;
  });
}

/** @param {ReturnType<typeof channelsOf>[number]} channel */
function linear(channel) {
  const group = make("div", "gauge-cell");
  make("span", "gauge-name", group, channel.spec.label);
  const value = make("span", "gauge-value", group);
  const difference = make("span", "gauge-difference", group);
  const shape = { viewBox: "0 -3 100 17", preserveAspectRatio: "none", "aria-hidden": "true" };
  const hands = bar(svg("svg", shape, group), channel.scale, 100, 9);
  add(channel, { group, value, difference, hands });
  return group;
}

/** @param {HTMLElement} root */
function build(root) {
  host = root;
  gauges = [];
  const figure = make("div", "engine-figure");
  figure.append(engine());
  make("p", "note engine-spread", figure);
  const dials = tachometers();
  const side = make("div", "engine-gauges");
  /** @type {Map<string, HTMLElement>} */
  const groups = new Map();
  for (const channel of channelsOf("bar")) {
    const { title } = channel.scale;
    let group = groups.get(title);
    if (!group) {
      group = make("div", "gauge-group", side);
      groups.set(title, group);
      make("h3", "chart-title", group, title);
    }
    group.append(linear(channel));
  }
  root.replaceChildren(figure, ...dials, side);
  new IntersectionObserver((sightings) => {
    inView = sightings[sightings.length - 1].isIntersecting;
    if (inView) ask();
  }).observe(root);
}

// ---- reading --------------------------------------------------------------------------------

/**
 * @param {Gauge} gauge
 * @param {number | null} time_s
 */
function read(gauge, time_s) {
  const { spec, scale, group, hands } = gauge;
  const reading = at(gauge.index, time_s);
  group.dataset.empty = String(reading === null);
  if (reading === null) {
    write(gauge.value, "–");
    write(gauge.difference, "");
    hands.fill(scale.low);
    hands.ghost(scale.low);
    group.setAttribute("aria-valuenow", String(scale.low)); // a meter must have one
    group.setAttribute("aria-valuetext", "no reading");
    gauge.status = "normal";
    return;
  }
  const { value, difference, label, decimals } = shown(spec);
  gauge.status = statusOf(scale, reading.faulted);
  const text = `${number(value(reading.faulted), decimals)} ${label}`;
  const way = beyond(scale, reading.faulted);
  write(gauge.value, (way > 0 ? "▲ " : way < 0 ? "▼ " : "") + text);
  write(gauge.difference, signed(difference(reading.faulted - reading.mirror), decimals));
  hands.fill(reading.faulted);
  hands.ghost(reading.mirror);
  group.dataset.status = gauge.status;
  group.setAttribute("aria-valuenow", reading.faulted.toFixed(spec.decimals));
  const word = gauge.status === "limit" || gauge.status === "caution" ? WORDS[gauge.status] : "";
  group.setAttribute("aria-valuetext", word ? `${text}, ${word}` : text);
}

/**
 * How far apart the cylinders are, which engine monitors call DIF.
 * @param {Gauge[]} alike
 * @param {number | null} time_s
 */
function spread(alike, time_s) {
  const readings = alike.map((gauge) => at(gauge.index, time_s)).filter((one) => one !== null);
  if (readings.length < alike.length) return "";
  const { difference, label } = shown(alike[0].spec);
  const width = (/** @type {number[]} */ values) =>
    difference(Math.max(...values) - Math.min(...values)).toFixed(0);
  const [faulted, mirror] = [readings.map((r) => r.faulted), readings.map((r) => r.mirror)];
  return `${alike[0].scale.title} ${width(faulted)} ${label} (mirror ${width(mirror)})`;
}

/** @param {number | null} time_s */
function summarise(time_s) {
  const flown_s = flownUntil();
  const time = byId("engine-time");
  if (time) write(time, flown_s > 0 ? `at ${clock(time_s ?? flown_s)}` : "");
  const onCylinders = gauges.filter(({ scale }) => scale.cylinder !== null);
  const spreads = [...new Set(onCylinders.map(({ scale }) => scale.title))]
    .map((title) =>
      spread(
        onCylinders.filter(({ scale }) => scale.title === title),
        time_s,
      ),
    )
    .filter(Boolean);
  const line = host?.querySelector(".engine-spread");
  if (line) write(line, spreads.length ? `Spread: ${spreads.join(", ")}` : "");
  const status = byId("engine-status");
  if (!status) return;
  const worst = /** @type {const} */ (["limit", "caution"]).find((kind) =>
    gauges.some((gauge) => gauge.status === kind),
  );
  const names = shortList(
    gauges.filter((gauge) => gauge.status === worst).map(({ spec }) => spec.label),
  );
  const words = { limit: `Limit: ${names}`, caution: `Caution: ${names}`, normal: "Within limits" };
  status.dataset.status = flown_s > 0 ? (worst ?? "normal") : "none";
  write(status, flown_s > 0 ? words[worst ?? "normal"] : "");
}

function show() {
  due = null;
  const root = byId("engine-view");
  if (!root || !specs.length) return;
  if (root !== host || !root.firstChild) build(root);
  if (!inView) return;
  const since = performance.now();
  for (const gauge of gauges) read(gauge, cursor_s);
  summarise(cursor_s);
  root.dataset.drawnMs = (performance.now() - since).toFixed(1);
}

// The first samples are painted first: two frames on.
function ask() {
  if (due !== null) return;
  const drawn = host?.isConnected;
  due = requestAnimationFrame(drawn ? show : () => requestAnimationFrame(show));
}

export function start() {
  flightChanged.listen(ask);
  cursorMoved.listen(ask);
  unitsChanged.listen(ask);
}
