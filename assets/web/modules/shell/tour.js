// The tour of Fly: a card beside one part of the page after the other. It takes nothing away: the page
// stays usable under it. Whether it has been taken or declined is remembered in this browser.

import { onKeys } from "../kit/keys.js";
import { around, byId, goTo, make } from "../kit/page.js";
import { place } from "../kit/popover.js";

const REMEMBERED = "mirrortwin-tour";
const CARD = "tour-card";
const GAP_PX = 10;
const HEADER_PX = 56;
const PATIENCE_MS = 15000;
const LOOK_AGAIN_MS = 100;

/** @typedef {{ target: string, title: string, text: string }} Stop */

/** @type {Stop[]} */
let stops = [];
let at = 0;
/** @type {HTMLElement | null} */
let card = null;
/** @type {Element | null} */
let cameFrom = null;

const invitation = () => byId("tour-invitation");

function remembered() {
  try {
    return localStorage.getItem(REMEMBERED);
  } catch {
    return "unknown"; // no storage here: nothing could be remembered, so do not ask
  }
}

/** @param {string} what */
function remember(what) {
  try {
    localStorage.setItem(REMEMBERED, what);
  } catch {
    // then it is asked again
  }
  const line = invitation();
  if (line) line.hidden = true;
}

// ---- the card -------------------------------------------------------------------------------

const targetOf = (/** @type {Stop} */ stop) => document.querySelector(stop.target);

const isVisible = (/** @type {Stop} */ stop) => (targetOf(stop)?.getClientRects().length ?? 0) > 0;

async function begin() {
  cameFrom = document.activeElement;
  remember("seen");
  if (!byId("fly")) goTo("/");
  const until = performance.now() + PATIENCE_MS;
  while (!document.querySelector(".tile canvas")) {
    if (performance.now() > until) return;
    await new Promise((later) => setTimeout(later, LOOK_AGAIN_MS));
  }
  /** @type {Stop[]} */
  const all = JSON.parse(invitation()?.dataset.stops ?? "[]");
  stops = all.filter(isVisible);
  at = 0;
  show();
}

function show() {
  clear();
  const target = stops.length ? targetOf(stops[at]) : null;
  if (!target) {
    end();
    return;
  }
  target.classList.add("tour-target");
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const tall = target.getBoundingClientRect().height > 0.7 * innerHeight;
  target.scrollIntoView({ block: tall ? "start" : "nearest", behavior: calm ? "auto" : "smooth" });
  card = cardOf(stops[at]);
  document.body.append(card);
  follow();
  /** @type {HTMLElement} */ (card.querySelector(".tour-next")).focus({ preventScroll: true });
}

/** @param {Stop} stop */
function cardOf(stop) {
  const made = make("div", `${CARD} panel`);
  made.setAttribute("role", "dialog");
  made.setAttribute("aria-labelledby", "tour-title");
  made.setAttribute("aria-describedby", "tour-text");
  make("h2", "", made, stop.title).id = "tour-title";
  make("p", "", made, stop.text).id = "tour-text";
  const buttons = make("div", "tour-buttons", made);
  make("span", "note", buttons, `${at + 1} of ${stops.length}`);
  const isLast = at === stops.length - 1;
  const add = (/** @type {string} */ text, /** @type {() => void} */ press, className = "") => {
    const button = make("button", className, buttons, text);
    button.setAttribute("type", "button");
    button.addEventListener("click", press);
  };
  if (!isLast) add("Skip", end);
  if (at > 0) add("Back", () => step(-1));
  add(isLast ? "Done" : "Next", () => step(1), "tour-next");
  return made;
}

// Under the header, and beside its target, which may scroll.
function follow() {
  const target = card && targetOf(stops[at]);
  if (!card || !target) return;
  const { left, top, right, bottom } = target.getBoundingClientRect();
  const anchor = { left, top: Math.max(top, HEADER_PX), right, bottom };
  place(card, anchor, ["right", "left", "below", "above"], GAP_PX);
}

/** @param {number} by */
function step(by) {
  if (at + by < 0) return;
  at += by;
  if (at >= stops.length) end();
  else show();
}

function clear() {
  document.querySelector(".tour-target")?.classList.remove("tour-target");
  if (card) card.remove();
  card = null;
}

function end() {
  clear();
  if (cameFrom?.isConnected) /** @type {HTMLElement} */ (cameFrom).focus();
}

/**
 * Whether the invitation is to be hidden on a page of that kind.
 * @param {string} kind
 */
export function invite(kind) {
  if (kind !== "fly" && card) end();
  return kind !== "fly" || remembered() !== null;
}

export function start() {
  addEventListener("scroll", follow, { passive: true });
  addEventListener("resize", follow);
  document.addEventListener("click", (event) => {
    const asked = around(event, "[data-tour]")?.dataset.tour;
    if (asked === "start") begin();
    else if (asked === "decline") remember("declined");
  });
  onKeys({ when: () => card !== null, always: true, keys: { Escape: end } });
  onKeys({
    within: `.${CARD}`,
    keys: { ArrowRight: () => step(1), ArrowLeft: () => step(-1) },
  });
}
