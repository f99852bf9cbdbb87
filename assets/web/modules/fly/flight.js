// The flight that the page shows: its samples, as the browser holds them, and what they read at a
// moment. Samples come from `app/figures/streamed.py` and `sensors.py` as float32 in base64, those of
// a part that was zoomed into from `detail.js`.

import { extended, floats, merged, patched, rowAfter, rowNear, unpacked } from "../kit/samples.js";

const MEAN_OVER_S = 2;

/** How many samples a page holds that holds the whole flight. */
export const WHOLE = Number.MAX_SAFE_INTEGER;

/**
 * @typedef {import("../kit/samples.js").Lines} Lines
 * @typedef {{ faulted: number, mirror: number }} Reading
 * @typedef {object} OtherUnit
 * @property {string} quantity
 * @property {number} factor
 * @property {number} offset
 * @property {string} label
 * @property {number} extra_decimals
 *
 * @typedef {object} Spec how a channel is shown, as `app/figures/sensors.py` has it
 * @property {string} name
 * @property {string} label
 * @property {string} unit
 * @property {number} decimals
 * @property {number} resting
 * @property {number} quiet
 * @property {number} still
 * @property {number[]} limits
 * @property {import("../kit/gauge.js").Scale | null} gauge
 * @property {OtherUnit | null} other
 *
 * @typedef {object} Message what the server sends of a flight: none, all, or more of its samples
 * @property {string} key
 * @property {string | null} run
 * @property {number} duration_s
 * @property {number | null} onset_s
 * @property {string[][]} [whole]
 * @property {number} [start]
 * @property {string} [time_s]
 * @property {string} [faulted]
 * @property {string} [mirror]
 * @property {number} [group]
 * @property {string[]} [extremes]
 *
 * @typedef {object} Flight
 * @property {string | null} key
 * @property {string | null} run
 * @property {number} duration_s
 * @property {number | null} onset_s
 * @property {number} count
 * @property {Lines[]} channels
 * @property {Lines[]} extremes
 * @property {Lines[] | null} finer
 * @property {Lines[]} drawn
 */

/** @type {Flight} */
export let flight = emptyFlight({ key: null, run: null, duration_s: 300, onset_s: null });

/** @type {Spec[]} */
export let specs = [];

/**
 * @param {{ key: string | null, run: string | null, duration_s: number, onset_s: number | null }} of
 * @returns {Flight}
 */
function emptyFlight({ key, run, duration_s, onset_s }) {
  const none = { count: 0, channels: [], extremes: [], finer: null, drawn: [] };
  return { key, run, duration_s, onset_s, ...none };
}

/** @param {Spec[]} channels */
export function describe(channels) {
  specs = channels;
}

// ---- samples --------------------------------------------------------------------------------

/**
 * Takes a message; returns whether it begins another flight.
 * @param {Message} message
 */
export function take(message) {
  const begins = message.key !== flight.key || (message.start ?? 0) > flight.count;
  if (begins) flight = emptyFlight(message);
  flight.onset_s = message.onset_s; // in a live flight it comes when it comes
  flight.duration_s = message.duration_s; // the ground may end it before its plan does
  flight.drawn = [];
  if (message.whole) replace(message.whole);
  // Of a long flight extremes come more often than samples: those may be none.
  else if (message.time_s !== undefined && (message.start ?? 0) <= flight.count) extend(message);
  return begins;
}

/**
 * Samples from `start` on, for all channels; whatever was there from `start` on is replaced.
 * @param {Message} message
 */
function extend({ start = 0, time_s = "", faulted = "", mirror = "", group = 0, extremes = [] }) {
  const time = floats(time_s);
  const sides = [floats(faulted), floats(mirror)];
  const n = time.length;
  const channelCount = n ? sides[0].length / n : 0;
  for (let index = 0; index < channelCount; index++) {
    const own = sides.map((side) => side.subarray(index * n, (index + 1) * n));
    flight.channels[index] = extended(flight.channels[index], start, [time, ...own]);
  }
  flight.count = start + n;
  extendExtremes(group, extremes.map(floats));
}

/**
 * The extremes of every stretch of the flight from `group` on, six samples of each stretch.
 * @param {number} group
 * @param {Float32Array[]} rows
 */
function extendExtremes(group, rows) {
  if (!flight.channels.length) return;
  const n = rows[0].length / flight.channels.length;
  flight.channels.forEach((_, index) => {
    const own = rows.map((row) => row.subarray(index * n, (index + 1) * n));
    flight.extremes[index] = extended(flight.extremes[index], 6 * group, own);
  });
}

/** @param {string[][]} whole */
function replace(whole) {
  flight.channels = unpacked(whole);
  flight.extremes = [];
  flight.count = WHOLE;
}

/**
 * A part of the flight in finer samples, as long as it is looked at closely; null: none any more.
 * @param {string[][] | null} whole
 */
export function refine(whole) {
  flight.finer = whole && unpacked(whole);
  flight.drawn = [];
}

// ---- what is drawn --------------------------------------------------------------------------

/**
 * Time, faulted and mirror of a channel, as fine as they are here.
 * @param {number} index
 * @returns {Lines}
 */
export function rows(index) {
  if (!flight.channels[index]) return [[], [], []];
  if (!flight.drawn[index]) {
    const coarse = merged(flight.channels[index], flight.extremes[index]);
    flight.drawn[index] = flight.finer ? patched(coarse, flight.finer[index]) : coarse;
  }
  return flight.drawn[index];
}

/** The latest time that there is something to see of. */
export function flownUntil() {
  const [time] = rows(0);
  return time.length ? time[time.length - 1] : 0;
}

/**
 * What a channel read at a time, or reads now (null); null where nothing has been flown.
 * @param {number} index
 * @param {number | null} time_s
 * @returns {Reading | null}
 */
export function at(index, time_s) {
  const [time, faulted, mirror] = rows(index);
  const last = time.length - 1;
  if (last < 0 || (time_s !== null && time_s > time[last] + MEAN_OVER_S)) return null;
  const row = rowNear(time, time_s);
  return { faulted: faulted[row], mirror: mirror[row] };
}

/**
 * The mean over 2 s around a time: two samples compared would compare their noise, and drawn samples
 * are the extreme ones.
 * @param {number} index
 * @param {number} time_s
 * @returns {Reading | null}
 */
export function mean(index, time_s) {
  const [time, faulted, mirror] = rows(index);
  const from = rowAfter(time, time_s - MEAN_OVER_S / 2);
  const to = rowAfter(time, time_s + MEAN_OVER_S / 2);
  if (to <= from) return at(index, time_s);
  const average = (/** @type {number[]} */ row) =>
    row.slice(from, to).reduce((sum, value) => sum + value, 0) / (to - from);
  return { faulted: average(faulted), mirror: average(mirror) };
}
