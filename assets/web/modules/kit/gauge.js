// What a gauge of the engine view says of a reading. The scales are those of
// `app/figures/engine_view.py`.

/**
 * @typedef {"limit" | "caution" | "normal" | "quiet"} Status
 * @typedef {{ from: number, to: number, status: Status }} Band
 * @typedef {{ side: "left" | "right", row: "front" | "rear" }} Place
 * @typedef {object} Scale
 * @property {number} low
 * @property {number} high
 * @property {Band[]} bands
 * @property {number[]} red
 * @property {number} order its place among all gauges
 * @property {string} form how it is drawn: on a cylinder, as a dial, or as a bar in a group
 * @property {string} title what gauges of its form are grouped under
 * @property {number | null} cylinder
 * @property {Place | null} place
 */

/**
 * Where on its scale a reading lies, 0 to 1.
 * @param {{ low: number, high: number }} scale
 * @param {number} value
 */
export const share = ({ low, high }, value) =>
  Math.min(Math.max((value - low) / (high - low), 0), 1);

/**
 * The status of the stretch of the scale that a reading lies in; the outer ones have no outer end.
 * @param {{ bands: Band[] }} scale
 * @param {number} value
 */
export function statusOf({ bands }, value) {
  const band = bands.find(({ to }) => value <= to) || bands[bands.length - 1];
  return band.status;
}

/**
 * Which way a reading lies that is outside the green arc: -1 below, 1 above, 0 for one that calls
 * for nothing.
 * @param {{ bands: Band[] }} scale
 * @param {number} value
 */
export function beyond(scale, value) {
  const status = statusOf(scale, value);
  if (status !== "limit" && status !== "caution") return 0;
  const green = scale.bands.find((band) => band.status === "normal");
  return green && value > green.from ? 1 : -1;
}

/**
 * The names of gauges with the kind once: "EGT 1, 2, Oil pressure".
 * @param {string[]} names
 */
export function shortList(names) {
  const kind = (/** @type {string} */ name) => name.replace(/ \d+$/, "");
  return names
    .map((name, at) => {
      const follows = at > 0 && name !== kind(name) && kind(names[at - 1]) === kind(name);
      return follows ? name.slice(kind(name).length + 1) : name;
    })
    .join(", ");
}
