// The shapes of the engine view, in SVG: the engine itself, and the bars and dials of its gauges.

import { share } from "../kit/gauge.js";

const SVG = "http://www.w3.org/2000/svg";
const CYLINDER = { width: 176, height: 92 };
const BAR = 144;
export const DIAL = { x: 84, y: 74, radius: 56, from: -210, to: 30 };

// From above, nose up: where the banks begin, and how far a row lies behind the one before. The right
// bank lies before the left, as its crank throws do.
const BANKS = { right: { inner: 258, top: 34, way: 1 }, left: { inner: 202, top: 44, way: -1 } };
const ROWS = { front: 0, rear: 108 };
const LINES = [2, 46]; // how far down a cylinder its first and its second gauge stand

/**
 * @typedef {import("../kit/gauge.js").Scale} Scale
 * @typedef {{ fill: (value: number) => void, ghost: (value: number) => void }} Hands
 * @typedef {{ left: number, top: number, way: number, gauges: number }} Cylinder
 */

/**
 * @param {string} name
 * @param {Record<string, string | number>} attributes
 * @param {Element | null} [parent]
 * @param {string} [text]
 */
export function svg(name, attributes, parent, text) {
  const node = /** @type {SVGElement} */ (document.createElementNS(SVG, name));
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, String(value));
  if (text !== undefined) node.textContent = text;
  if (parent) parent.append(node);
  return node;
}

// ---- hands ----------------------------------------------------------------------------------

/**
 * A bar from the scale's zero, or its low end, to the reading; drawn from 0 to `length`.
 * @param {Element} parent
 * @param {Scale} scale
 * @param {number} length
 * @param {number} height
 * @returns {Hands}
 */
export function bar(parent, scale, length, height) {
  svg("rect", { class: "track", width: length, height, rx: 2 }, parent);
  for (const band of scale.bands) {
    const x = length * share(scale, band.from);
    const width = Math.max(length * share(scale, band.to) - x, 0);
    svg("rect", { class: `band ${band.status}`, x, y: height + 1.5, width, height: 2.5 }, parent);
  }
  const fill = svg("rect", { class: "fill", height, rx: 1.5 }, parent);
  const ghost = svg("rect", { class: "ghost", height, rx: 1.5 }, parent);
  for (const limit of scale.red) {
    const x = length * share(scale, limit);
    svg("line", { class: "redline", x1: x, x2: x, y1: -2.5, y2: height + 4 }, parent);
  }
  const zero = share(scale, 0) * length;
  return {
    fill: (value) => stretch(fill, zero, length * share(scale, value)),
    ghost: (value) => stretch(ghost, zero, length * share(scale, value)),
  };
}

/**
 * @param {Element} rect
 * @param {number} from
 * @param {number} to
 */
function stretch(rect, from, to) {
  rect.setAttribute("x", Math.min(from, to).toFixed(1));
  rect.setAttribute("width", Math.max(Math.abs(to - from), 0.5).toFixed(1));
}

/**
 * @param {Element} parent
 * @param {Scale} scale
 * @returns {Hands}
 */
export function dial(parent, scale) {
  const angleOf = (/** @type {number} */ value) =>
    DIAL.from + (DIAL.to - DIAL.from) * share(scale, value);
  svg("path", { class: "track-arc", d: arcPath(DIAL.from, DIAL.to, DIAL.radius) }, parent);
  for (const band of scale.bands) {
    const [from, to] = [angleOf(band.from), angleOf(band.to)];
    if (to <= from) continue;
    const d = arcPath(from, to, DIAL.radius + 7);
    svg("path", { class: `band-arc ${band.status}`, d }, parent);
  }
  for (const limit of scale.red) {
    const [x1, y1] = pointOn(angleOf(limit), DIAL.radius - 6);
    const [x2, y2] = pointOn(angleOf(limit), DIAL.radius + 10);
    svg("line", { class: "redline", x1, y1, x2, y2 }, parent);
  }
  const hand = (/** @type {string} */ kind) => {
    const [x1, x2] = [DIAL.x + 26, DIAL.x + DIAL.radius + 3];
    const needle = svg("line", { class: kind, x1, x2, y1: DIAL.y, y2: DIAL.y }, parent);
    return (/** @type {number} */ value) =>
      needle.setAttribute("transform", `rotate(${angleOf(value).toFixed(2)} ${DIAL.x} ${DIAL.y})`);
  };
  const ghost = hand("needle-ghost");
  return { ghost, fill: hand("needle") };
}

/**
 * @param {number} angle_deg
 * @param {number} radius
 */
function pointOn(angle_deg, radius) {
  const angle = (angle_deg * Math.PI) / 180;
  return [DIAL.x + radius * Math.cos(angle), DIAL.y + radius * Math.sin(angle)];
}

/**
 * @param {number} from
 * @param {number} to
 * @param {number} radius
 */
function arcPath(from, to, radius) {
  const [x1, y1] = pointOn(from, radius);
  const [x2, y2] = pointOn(to, radius);
  return `M${x1} ${y1} A${radius} ${radius} 0 ${to - from > 180 ? 1 : 0} 1 ${x2} ${y2}`;
}

// ---- the engine -----------------------------------------------------------------------------

/**
 * The engine with the cylinders that its gauges are on.
 * @param {Scale[]} scales
 */
export function drawEngine(scales) {
  const drawing = svg("svg", { viewBox: "0 0 460 256", class: "engine-drawing" });
  const metal = svg("g", { class: "metal", "aria-hidden": "true" }, drawing);
  drawCase(metal);
  /** @type {Record<number, Cylinder>} */
  const cylinders = {};
  for (const { cylinder, place } of scales) {
    if (cylinder === null || place === null || cylinders[cylinder]) continue;
    cylinders[cylinder] = drawCylinder(drawing, metal, cylinder, place);
  }
  return { drawing, cylinders };
}

/** @param {Element} metal */
function drawCase(metal) {
  const blade =
    "M230 8 C190 0 120 2 92 8 C120 14 190 15 230 10 Z M230 8 C270 15 340 14 368 8 C340 2 270 0 230 8 Z";
  svg("path", { class: "blade", d: blade }, metal);
  const spinner = "M216 18 C218 6 224 1 230 1 C236 1 242 6 244 18 Z";
  svg("path", { class: "spinner", d: spinner }, metal);
  svg("rect", { class: "case", x: 210, y: 18, width: 40, height: 8, rx: 2 }, metal);
  const halves = "M208 26 H252 L258 36 V236 L250 246 H210 L202 236 V36 Z";
  svg("path", { class: "case", d: halves }, metal);
  svg("line", { class: "seam", x1: 230, x2: 230, y1: 30, y2: 244 }, metal);
  for (const x of [211, 234]) {
    svg("rect", { class: "case", x, y: 244, width: 15, height: 11, rx: 2 }, metal);
  }
}

/**
 * @param {Element} drawing
 * @param {Element} metal
 * @param {number} number
 * @param {import("../kit/gauge.js").Place} place
 * @returns {Cylinder} where its gauges go
 */
function drawCylinder(drawing, metal, number, place) {
  const { width, height } = CYLINDER;
  const { inner, way, top: first } = BANKS[place.side];
  const top = first + ROWS[place.row];
  const x = way > 0 ? inner : inner - width;
  const body = svg("g", { transform: `translate(${inner} ${top}) scale(${way} 1)` }, metal);
  for (let fin = 8; fin < width - 16; fin += 6) {
    svg("line", { class: "fin", x1: fin, x2: fin, y1: -3, y2: height + 3 }, body);
  }
  svg("rect", { class: "barrel", width: width - 10, height }, body);
  const [from, to] = [width - 18, width + 4];
  const head =
    `M${from} -3 H${to - 10} Q${to} -3 ${to} 8 V${height - 8} ` +
    `Q${to} ${height + 3} ${to - 10} ${height + 3} H${from} Z`;
  svg("path", { class: "head", d: head }, body);
  const badge = way > 0 ? x + width - 7 : x + 7;
  const middle = top + height / 2 + 5;
  svg("text", { class: "cylinder-number", x: badge, y: middle }, drawing, String(number));
  return { left: way > 0 ? x + 8 : x + width - 8 - BAR, top, way, gauges: 0 };
}

/**
 * The next gauge on a cylinder, under those that it has.
 * @param {Element} drawing
 * @param {Cylinder} cylinder
 * @param {string} title
 * @param {Scale} scale
 */
export function gaugesAt(drawing, cylinder, title, scale) {
  const { left, top, way } = cylinder;
  const y = top + LINES[cylinder.gauges++];
  const group = svg("g", { transform: `translate(${left} ${y})` }, drawing);
  svg("text", { class: "gauge-name", y: 14 }, group, title);
  const value = svg("text", { class: "gauge-value", x: BAR / 2 + 24, y: 14 }, group);
  const difference = svg("text", { class: "gauge-difference", x: BAR, y: 14 }, group);
  const mirrored = way > 0 ? "translate(0 20)" : `translate(${BAR} 20) scale(-1 1)`;
  const hands = bar(svg("g", { transform: mirrored }, group), scale, BAR, 13);
  return { group, value, difference, hands };
}
