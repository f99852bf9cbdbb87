// The time cursor: one moment of the flight, shown by all charts, readouts and 3D views at once. It
// is moved by pointing at a chart, by the slider under the flight path, by its keys, or by playing.
// Whoever shows it listens to `cursorMoved`; the server moves the aircraft of the live view.

import { byId, setProps } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { cursorMoved, flightChanged, flightReplaced } from "./changes.js";
import { flight, flownUntil } from "./flight.js";

const ANNOUNCE_MS = 100;
const REST_MS = 250;
const LATE_MS = 5000; // so late may the slider report a value that we have set

/** @typedef {ReturnType<typeof setTimeout>} Timer */

/** @type {number | null} null: nothing pointed at, the views show the latest */
export let cursor_s = null;
/** @type {number | null} where it was put, and returns to */
let parked_s = null;
/** @type {number | null} the frame at which it plays on; null: it does not play */
let playing = null;
let speed = 10;
/** @type {number | null} */
let due = null;
/** @type {Timer | null} */
let announced = null;
/** @type {Timer | undefined} */
let resting;
let slid = 0; // the value of the slider in Dash
/** @type {{ value: number, until_ms: number }[]} */
let ours = []; // values that we have set, and that the slider has not reported yet

/** The moment that readings are of: at the cursor, or the latest. */
export const here = () => cursor_s ?? flownUntil();

export const isPlaying = () => playing !== null;

/**
 * However often it is moved, it is shown once a frame.
 * @param {number | null} to_s
 */
export function move(to_s) {
  parked_s = to_s;
  look(to_s);
}

/**
 * A pointer over a chart looks elsewhere for as long as it is there; not while the flight plays.
 * @param {number | null} to_s
 */
export function point(to_s) {
  if (playing === null) look(to_s ?? parked_s);
}

/** @param {number | null} at_s */
function look(at_s) {
  cursor_s = at_s;
  if (due === null) due = requestAnimationFrame(show);
}

function show() {
  due = null;
  cursorMoved.send(cursor_s);
  showSlider();
  if (announced === null) announced = setTimeout(announce, ANNOUNCE_MS);
  restSoon();
}

function restSoon() {
  clearTimeout(resting);
  resting = setTimeout(rest, REST_MS);
}

// The slider as React will draw it once the cursor rests: each time costs it many milliseconds.
function showSlider() {
  /** @type {HTMLElement | null} */
  const thumb = document.querySelector("#scrub [role='slider']");
  /** @type {HTMLElement | null} */
  const bar = document.querySelector("#scrub .mantine-Slider-bar");
  const text = byId("scrub-time");
  if (!thumb || !bar || !text) return;
  const share = (100 * here()) / flight.duration_s;
  thumb.style.setProperty("--slider-thumb-offset", `${share}%`);
  bar.style.setProperty("--slider-bar-width", `calc(${share}% + 2 * var(--slider-size))`);
  text.textContent = clock(here());
  thumb.setAttribute("aria-valuetext", text.textContent);
}

function rest() {
  if (here() === slid) return;
  slid = here();
  ours.push({ value: slid, until_ms: performance.now() + LATE_MS });
  setProps("scrub", { value: slid });
}

// The aircraft are moved by the server.
function announce() {
  announced = null;
  setProps("cursor", { data: cursor_s });
  /** @type {HTMLIFrameElement | null} */
  const replay = document.querySelector("#scene iframe[sandbox]");
  if (replay && cursor_s !== null) {
    replay.contentWindow?.postMessage({ type: "seek", time_s: cursor_s }, "*");
  }
}

/**
 * The slider also reports the values that we set, perhaps after the hand's next move: only a hand on it
 * moves the cursor.
 * @param {number} value
 */
export function scrub(value) {
  const now_ms = performance.now();
  ours = ours.filter((each) => each.until_ms > now_ms);
  const place = ours.findIndex((each) => each.value === value);
  if (place >= 0) {
    ours.splice(0, place + 1);
    slid = value;
    restSoon(); // the cursor may be elsewhere by now
    return;
  }
  if (value === slid) return;
  slid = value;
  const root = byId("scrub");
  const handled = root?.matches(":hover") || root?.contains(document.activeElement);
  if (handled && cursor_s !== value && playing === null) move(value);
}

// ---- playing --------------------------------------------------------------------------------

export function play() {
  const end_s = flownUntil();
  if (!(end_s > 0)) return;
  let from_s = cursor_s === null || cursor_s >= end_s ? 0 : cursor_s;
  let before = performance.now();
  const step = (/** @type {number} */ now) => {
    if (!byId("scrub")) {
      stop(); // the page has been left
      return;
    }
    from_s += ((now - before) / 1000) * speed;
    before = now;
    if (from_s >= end_s) {
      move(end_s);
      stop();
      return;
    }
    move(from_s);
    playing = requestAnimationFrame(step);
  };
  playing = requestAnimationFrame(step);
  showPlaying();
}

export function stop() {
  if (playing !== null) cancelAnimationFrame(playing);
  playing = null;
  showPlaying();
}

function showPlaying() {
  const button = byId("play");
  if (!button) return;
  button.textContent = playing === null ? "▶" : "❚❚";
  button.setAttribute("aria-label", playing === null ? "Play the flight" : "Pause");
}

/** @param {string | number} value */
export function setSpeed(value) {
  speed = Number(value);
}

export function start() {
  flightReplaced.listen(() => move(null));
  flightChanged.listen(() => {
    if (cursor_s !== null) return;
    showSlider();
    restSoon();
  });
}
