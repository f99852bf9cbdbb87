// Samples of a flight as the browser holds them: unpacked, put together and looked up.

/**
 * The lines of one channel, of equal length: time, faulted and mirror.
 * @typedef {number[][]} Lines
 */

/**
 * Float32 values from the base64 text that `app/figures/axes.py` makes of them.
 * @param {string} base64
 */
export function floats(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  // Not by `Uint8Array.from`, which takes ten times as long for its call a byte.
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  return new Float32Array(bytes.buffer);
}

/**
 * The lines of all channels.
 * @param {string[][]} channels
 * @returns {Lines[]}
 */
export const unpacked = (channels) =>
  channels.map((rows) => rows.map((row) => Array.from(floats(row))));

/**
 * The lines of a channel with `values` from row `start` on, in the place of what was there.
 * @param {Lines | undefined} before
 * @param {number} start
 * @param {Float32Array[]} values
 * @returns {Lines}
 */
export const extended = (before, start, values) =>
  values.map((row, line) => (before?.[line] ?? []).slice(0, start).concat(Array.from(row)));

/**
 * Two lists of samples as one, in order of time, each sample once.
 * @param {Lines} one
 * @param {Lines | undefined} other
 * @returns {Lines}
 */
export function merged(one, other) {
  if (!other?.[0].length) return one;
  /** @type {Lines} */
  const both = [[], [], []];
  let [from, last] = [0, -1];
  const take = (/** @type {Lines} */ rows, /** @type {number} */ at) => {
    if (rows[0][at] > last) {
      both.forEach((row, line) => {
        row.push(rows[line][at]);
      });
    }
    last = Math.max(last, rows[0][at]);
  };
  for (let at = 0; at < one[0].length; at++) {
    while (from < other[0].length && other[0][from] < one[0][at]) take(other, from++);
    take(one, at);
  }
  while (from < other[0].length) take(other, from++);
  return both;
}

/**
 * The finer samples in the place of the coarse ones that lie among them.
 * @param {Lines} coarse
 * @param {Lines} finer
 * @returns {Lines}
 */
export function patched(coarse, finer) {
  const [time] = finer;
  if (!time.length) return coarse;
  const from = rowAfter(coarse[0], time[0]);
  const to = rowAfter(coarse[0], time[time.length - 1] + 1e-3);
  return coarse.map((row, line) => row.slice(0, from).concat(finer[line], row.slice(to)));
}

/**
 * The first sample at or after a time.
 * @param {number[]} time
 * @param {number} time_s
 */
export function rowAfter(time, time_s) {
  let low = 0;
  let high = time.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time[middle] < time_s) low = middle + 1;
    else high = middle;
  }
  return low;
}

/**
 * The sample nearest to a time; the last one for no time (null).
 * @param {number[]} time
 * @param {number | null} time_s
 */
export function rowNear(time, time_s) {
  const last = time.length - 1;
  if (time_s === null) return last;
  const row = Math.min(rowAfter(time, time_s), last);
  return row > 0 && time_s - time[row - 1] < time[row] - time_s ? row - 1 : row;
}
