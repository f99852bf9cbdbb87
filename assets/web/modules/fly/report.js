// Sentences of the report that cite something: a click, Enter or Space moves the time cursor to
// where it shows and lights the channels. Arrow keys go from sentence to sentence; Escape puts the
// lights out. What a sentence cites is in its data attributes, which `app/pages/report/text.py` sets.

import { onKeys } from "../kit/keys.js";
import { around, byId } from "../kit/page.js";
import { move } from "./cursor.js";

const CITING = '.claim[role="button"]';

function lightsOut() {
  for (const tile of document.querySelectorAll(".tile.cited")) tile.classList.remove("cited");
  for (const claim of document.querySelectorAll(".claim[aria-pressed]")) {
    claim.removeAttribute("aria-pressed");
  }
}

/** @param {HTMLElement} claim */
function show(claim) {
  const wasLit = claim.getAttribute("aria-pressed") === "true";
  lightsOut();
  if (wasLit) return;
  claim.setAttribute("aria-pressed", "true");
  const tiles = (claim.dataset.tiles ?? "")
    .split(" ")
    .map((index) => byId(`tile-${index}`)?.closest(".tile"))
    .filter((tile) => tile !== null && tile !== undefined);
  for (const tile of tiles) tile.classList.add("cited");
  if (tiles.length) tiles[0].scrollIntoView({ block: "nearest" });
  if (claim.dataset.startS) move(Number(claim.dataset.startS));
}

/** @param {number} by */
const step = (by) => (/** @type {Event} */ _, /** @type {HTMLElement | null} */ claim) => {
  const report = claim?.closest(".report");
  if (!claim || !report) return;
  const all = /** @type {HTMLElement[]} */ ([...report.querySelectorAll(CITING)]);
  const next = all[all.indexOf(claim) + by];
  if (!next) return;
  claim.tabIndex = -1;
  next.tabIndex = 0;
  next.focus();
};

const showWithin = (/** @type {Event} */ _, /** @type {HTMLElement | null} */ claim) => {
  if (claim) show(claim);
};

export function start() {
  document.addEventListener("click", (event) => {
    if (around(event, "#run, #again, #retry")) lightsOut();
    const claim = around(event, CITING);
    if (claim && getSelection()?.isCollapsed) show(claim);
  });
  onKeys({ always: true, shared: true, keys: { Escape: lightsOut } });
  onKeys({
    within: CITING,
    keys: { Enter: showWithin, " ": showWithin, ArrowDown: step(1), ArrowUp: step(-1) },
  });
}
