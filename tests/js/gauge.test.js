import assert from "node:assert/strict";
import { test } from "node:test";

import { beyond, share, shortList, statusOf } from "../../assets/web/modules/kit/gauge.js";

/** @type {import("../../assets/web/modules/kit/gauge.js").Band[]} */
const bands = [
  { from: 0, to: 25, status: "limit" },
  { from: 25, to: 60, status: "quiet" },
  { from: 60, to: 90, status: "normal" },
  { from: 90, to: 115, status: "caution" },
  { from: 115, to: 130, status: "limit" },
];
const scale = { low: 0, high: 130, bands };

test("a reading has the status of the stretch that it lies in, the outer ones without end", () => {
  const readings = [-5, 20, 40, 75, 90, 91, 120, 999];
  assert.deepEqual(
    readings.map((value) => statusOf(scale, value)),
    ["limit", "limit", "quiet", "normal", "normal", "caution", "limit", "limit"],
  );
});

test("what calls for something lies above or below the green arc", () => {
  assert.deepEqual(
    [20, 40, 75, 100, 120].map((value) => beyond(scale, value)),
    [-1, 0, 0, 1, 1],
  );
});

test("hands stop at the ends of the scale", () => {
  assert.deepEqual(
    [-10, 0, 65, 130, 200].map((value) => share(scale, value)),
    [0, 0, 0.5, 1, 1],
  );
});

test("gauges of one kind are named once", () => {
  assert.equal(
    shortList(["EGT 1", "EGT 2", "CHT 2", "Oil pressure"]),
    "EGT 1, 2, CHT 2, Oil pressure",
  );
  assert.equal(shortList(["Oil pressure", "Fuel left"]), "Oil pressure, Fuel left");
  assert.equal(shortList([]), "");
});
