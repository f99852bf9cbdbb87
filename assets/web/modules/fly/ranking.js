// The classifier's answer at the time cursor. Without a cursor the page shows its verdict instead,
// which the server writes. The answers of all windows come from `track` in `app/figures/marks.py`.

import { byId, make } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { cursorMoved } from "./changes.js";
import { cursor_s } from "./cursor.js";
import { flight } from "./flight.js";

/**
 * @typedef {[number, number]} Leader place of the class, and its share
 * @typedef {object} Track
 * @property {string} run
 * @property {{ name: string, colour: string | null }[]} classes
 * @property {number[]} time_s the ends of the windows
 * @property {Leader[][]} leaders
 */

/** @type {Track | null} */
let track = null;

/**
 * The newest window that had ended by then, -1 for none.
 * @param {number[]} ends_s
 * @param {number} time_s
 */
export const windowAt = (ends_s, time_s) => ends_s.findLastIndex((end_s) => end_s <= time_s);

/** @param {Element} list */
function addRow(list) {
  const item = make("li", "", list);
  make("span", "rank-name", item);
  make("span", "rank-fill", make("span", "rank-bar", item));
  make("span", "rank-share mono", item);
}

/**
 * @param {Element} list
 * @param {Leader[]} leaders
 * @param {Track["classes"]} classes
 */
function fill(list, leaders, classes) {
  while (list.children.length < leaders.length) addRow(list);
  [...list.children].forEach((row, rank) => {
    const item = /** @type {HTMLElement} */ (row);
    item.hidden = rank >= leaders.length;
    if (item.hidden) return;
    const [place, share] = leaders[rank];
    const { name, colour } = classes[place];
    const [label, bar, value] = item.children;
    const { style } = /** @type {HTMLElement} */ (bar.firstChild);
    label.textContent = name;
    style.width = `${(100 * share).toFixed(1)}%`;
    style.backgroundColor = colour || "var(--mirror)";
    value.textContent = `${(100 * share).toFixed(1)} %`;
  });
}

function show() {
  const place = byId("ranking-at");
  const verdict = byId("ranking");
  if (!place || !verdict) return;
  const followed = track?.run === flight.run && track.time_s.length > 0 ? track : null;
  const follows = cursor_s !== null && followed !== null;
  place.hidden = !follows;
  verdict.hidden = follows;
  if (cursor_s === null || followed === null) return;
  if (!place.firstChild) {
    make("p", "note", place);
    make("ol", "ranking", place);
  }
  const [note, list] = place.children;
  const found = windowAt(followed.time_s, cursor_s);
  const at = clock(cursor_s);
  note.textContent =
    found < 0
      ? `No answer yet at ${at}: the first window ends at ${clock(followed.time_s[0])}.`
      : `Answer at ${at}, to the 30 s up to ${clock(followed.time_s[found])}`;
  /** @type {HTMLElement} */ (list).hidden = found < 0;
  if (found >= 0) fill(list, followed.leaders[found], followed.classes);
}

/** @param {Track | null} message */
export function take(message) {
  track = message || null;
  show();
}

export function start() {
  cursorMoved.listen(show);
}
