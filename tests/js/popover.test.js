import assert from "node:assert/strict";
import { test } from "node:test";

import { placed } from "../../assets/web/modules/kit/popover.js";

const view = { width: 1000, height: 800 };
const size = { width: 200, height: 100 };

/** @param {number} left @param {number} top @param {number} width @param {number} height */
const box = (left, top, width, height) => ({
  left,
  top,
  right: left + width,
  bottom: top + height,
});

test("a box stands on the first side that has room", () => {
  const middle = box(400, 300, 100, 50);
  assert.deepEqual(placed(middle, size, view, ["right", "left"], 10), [510, 300]);
  const right = box(850, 300, 100, 50);
  assert.deepEqual(placed(right, size, view, ["right", "left"], 10), [640, 300]);
  const wide = box(0, 300, 1000, 50);
  assert.deepEqual(placed(wide, size, view, ["right", "left", "below", "above"], 10), [4, 360]);
});

test("over a word it stands in the middle, under it at the top of the page", () => {
  assert.deepEqual(placed(box(400, 300, 100, 20), size, view, ["over", "under"], 6), [350, 194]);
  assert.deepEqual(placed(box(0, 20, 40, 20), size, view, ["over", "under"], 6), [4, 46]);
});

test("it stays inside the window, over the corner of what leaves no room", () => {
  assert.deepEqual(placed(box(400, 780, 100, 20), size, view, ["right"], 10), [510, 696]);
  assert.deepEqual(placed(box(0, 0, 1000, 800), size, view, ["right", "below"], 10), [784, 684]);
});
