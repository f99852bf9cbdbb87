// The moments worth marking on every chart, and the list of them under the flight path. What is
// marked comes from `app/figures/marks.py`, the onset with the flight.

import { byId, make } from "../kit/page.js";
import { clock } from "../kit/time.js";
import { flightChanged, flightReplaced, marksChanged } from "./changes.js";
import { flight } from "./flight.js";

/**
 * @typedef {import("./changes.js").Mark} Mark
 * @typedef {{ run: string, marks: Mark[] }} Message
 */

/** @type {Mark[]} */
export let marks = [];
/** @type {Message[]} */
let sent = [];

/**
 * Takes what the server says of runs; that may come before the flight itself.
 * @param {...(Message | null)} messages
 */
export function showMarks(...messages) {
  sent = messages.filter((message) => message !== null && message !== undefined);
  showSent();
}

function showSent() {
  const { onset_s, run } = flight;
  marks = onset_s === null ? [] : [{ kind: "onset", time_s: onset_s, label: "Onset" }];
  for (const message of sent) if (message.run === run) marks.push(...message.marks);
  marks.sort((one, other) => one.time_s - other.time_s);
  marksChanged.send(marks);
  list();
}

// Each mark once, as a button that goes there; of several excesses of one limit the first.
function list() {
  const place = byId("moments");
  if (!place) return;
  const listed = new Set();
  const buttons = [];
  for (const mark of marks) {
    if (listed.has(mark.label)) continue;
    listed.add(mark.label);
    const button = make("button", `moment-button ${mark.kind}-mark`);
    button.setAttribute("type", "button");
    button.dataset.timeS = String(mark.time_s);
    button.append(make("i", ""), `${mark.label} `, make("b", "", null, clock(mark.time_s)));
    buttons.push(button);
  }
  place.replaceChildren(...buttons);
}

// The onset of a live flight comes when it comes.
function followOnset() {
  const marked = marks.find(({ kind }) => kind === "onset");
  if ((marked ? marked.time_s : null) !== flight.onset_s) showSent();
}

export function start() {
  flightReplaced.listen(showSent);
  flightChanged.listen(followOnset);
}
