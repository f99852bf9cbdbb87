// Words that explain themselves, `term` in `app/kit/terms.py`: what they mean shows beside them while
// the pointer rests on them or they have the focus. Escape, or going elsewhere, takes it away.

import { onKeys } from "../kit/keys.js";
import { around, byId, make } from "../kit/page.js";
import { place } from "../kit/popover.js";

const DELAY_MS = 200;
const GAP_PX = 6;
const ID = "meaning";

/** @type {HTMLElement | null} */
let shownFor = null;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let waiting;

/** @param {HTMLElement} word */
function show(word) {
  hide();
  shownFor = word;
  const box = make("div", ID, document.body, word.dataset.meaning);
  box.id = ID;
  box.setAttribute("role", "tooltip");
  word.setAttribute("aria-describedby", ID);
  place(box, word.getBoundingClientRect(), ["over", "under"], GAP_PX);
}

function hide() {
  clearTimeout(waiting);
  if (shownFor) shownFor.removeAttribute("aria-describedby");
  byId(ID)?.remove();
  shownFor = null;
}

/** @param {Event} event */
const wordOf = (event) => around(event, ".term[data-meaning]");

/** @param {PointerEvent} event */
function pointAt(event) {
  const word = wordOf(event);
  if (word && word === shownFor) return;
  // What it says can itself be pointed at, to be read at leisure.
  if (/** @type {Element} */ (event.target).id === ID) return;
  if (shownFor && document.activeElement !== shownFor) hide();
  clearTimeout(waiting);
  if (word) waiting = setTimeout(show, DELAY_MS, word);
}

export function start() {
  document.addEventListener("pointerover", pointAt);
  document.addEventListener("focusin", (event) => {
    const word = wordOf(event);
    if (word) show(word);
  });
  document.addEventListener("focusout", (event) => wordOf(event) && hide());
  document.addEventListener("scroll", () => shownFor && hide(), { capture: true, passive: true });
  onKeys({ always: true, shared: true, keys: { Escape: hide } });
}
