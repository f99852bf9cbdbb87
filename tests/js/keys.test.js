import assert from "node:assert/strict";
import { test } from "node:test";

import {
  deliver,
  hasUseFor,
  MOVED_BY_KEYS,
  nameOf,
  TEXT_FIELDS,
} from "../../assets/web/modules/kit/keys.js";

/** An element that these selectors match. @param {...string} selectors */
const element = (...selectors) => {
  const own = {
    closest: (/** @type {string} */ asked) => (selectors.includes(asked) ? own : null),
  };
  return /** @type {HTMLElement} */ (/** @type {unknown} */ (own));
};

/** @param {string} key @param {HTMLElement} target @param {object} [with_] */
const press = (key, target, with_ = {}) => {
  const event = {
    key,
    target,
    ctrlKey: false,
    metaKey: false,
    altKey: false,
    ...with_,
    taken: false,
  };
  const preventDefault = () => {
    event.taken = true;
  };
  return /** @type {any} */ (Object.assign(event, { preventDefault }));
};

const page = element();
const field = element(TEXT_FIELDS);
const slider = element(MOVED_BY_KEYS);

test("keys have names in which Ctrl and ⌘ are one, and capitals none", () => {
  assert.equal(nameOf(press("a", page)), "a");
  assert.equal(nameOf(press("P", page, { shiftKey: true })), "p");
  assert.equal(nameOf(press("Enter", page, { metaKey: true })), "Mod+Enter");
  assert.equal(nameOf(press("Enter", page, { ctrlKey: true })), "Mod+Enter");
  assert.equal(nameOf(press("ArrowLeft", page, { altKey: true })), "Alt+ArrowLeft");
});

test("who types has a use for every key, a slider for those that move it", () => {
  for (const name of ["a", " ", "Escape", "ArrowLeft"]) assert.equal(hasUseFor(field, name), true);
  for (const name of [" ", "Home", "ArrowLeft", "PageUp"]) assert.ok(hasUseFor(slider, name));
  for (const name of ["a", "Escape", "+"]) assert.equal(hasUseFor(slider, name), false);
  assert.equal(hasUseFor(page, " "), false);
});

test("the first that a key is bound for takes it", () => {
  /** @type {string[]} */
  const done = [];
  const note = (/** @type {string} */ what) => () => {
    done.push(what);
  };
  /** @type {import("../../assets/web/modules/kit/keys.js").Binding[]} */
  const bindings = [
    { shared: true, always: true, keys: { Escape: note("hint away") } },
    { when: () => false, keys: { Escape: note("never"), p: note("never") } },
    { keys: { Escape: note("view left"), p: note("view") } },
    { keys: { Escape: note("too late") } },
  ];
  const pressed = press("Escape", page);
  deliver(pressed, bindings);
  assert.deepEqual(done.splice(0), ["hint away", "view left"]);
  assert.equal(pressed.taken, true);
  const typed = press("Escape", field);
  deliver(typed, bindings);
  assert.deepEqual(done.splice(0), ["hint away"]);
  assert.equal(typed.taken, false);
  deliver(press("p", page, { ctrlKey: true }), bindings);
  assert.deepEqual(done, []);
});

test("keys that are for an element come with it, and only from there", () => {
  /** @type {unknown[]} */
  const got = [];
  const bindings = [
    {
      within: ".space",
      keys: { "+": (/** @type {Event} */ _, /** @type {unknown} */ at) => got.push(at) },
    },
  ];
  const space = element(".space", MOVED_BY_KEYS);
  deliver(press("+", page), bindings);
  deliver(press("+", space), bindings);
  assert.deepEqual(got, [space]);
});

test("keys that an object has by nature are not bound", () => {
  const event = press("constructor", page);
  deliver(event, [{ keys: {} }]);
  assert.equal(event.taken, false);
});
