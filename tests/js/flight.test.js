import assert from "node:assert/strict";
import { test } from "node:test";

import * as held from "../../assets/web/modules/fly/flight.js";
import { windowAt } from "../../assets/web/modules/fly/ranking.js";
import { chooseUnits, shown } from "../../assets/web/modules/fly/units.js";
import { tickLabel } from "../../assets/web/modules/kit/plot.js";
import { chosen, search } from "../../assets/web/modules/runs/selection.js";

const packed = (/** @type {number[]} */ values) =>
  Buffer.from(Float32Array.from(values).buffer).toString("base64");

/** A message of two channels from `start` on. @param {number} start @param {number[]} time */
const message = (start, time, key = "k") => ({
  key,
  run: "r",
  duration_s: 60,
  onset_s: null,
  start,
  time_s: packed(time),
  faulted: packed([...time.map((at) => at), ...time.map((at) => -at)]),
  mirror: packed([...time.map(() => 1), ...time.map(() => 2)]),
  group: 0,
  extremes: [packed([0, 0]), packed([5, 5]), packed([6, 6])],
});

test("samples are taken as they come, and again from where they start", () => {
  assert.equal(held.take(message(0, [1, 2, 3])), true);
  assert.equal(held.take(message(2, [3, 4])), false);
  assert.equal(held.flight.count, 4);
  assert.deepEqual(held.rows(1), [
    [0, 1, 2, 3, 4],
    [5, -1, -2, -3, -4],
    [6, 2, 2, 2, 2],
  ]);
  assert.equal(held.flownUntil(), 4);
});

test("extremes may come without samples", () => {
  held.take({
    ...message(4, []),
    faulted: "",
    mirror: "",
    group: 1,
    extremes: Array(3).fill(packed([2.5, 2.5])),
  });
  assert.equal(held.flight.count, 4);
  assert.deepEqual(held.rows(0)[0], [0, 1, 2, 2.5, 3, 4]);
});

test("another flight, or one that skips samples, takes the place of what is held", () => {
  assert.equal(held.take(message(0, [1], "other")), true);
  assert.equal(held.flight.key, "other");
  assert.equal(held.take(message(9, [9], "other")), true);
  assert.equal(held.flight.count, 0);
});

test("the whole flight takes the place of what was streamed", () => {
  const lines = [packed([0, 10]), packed([1, 3]), packed([1, 1])];
  held.take({ key: "w", run: "r", duration_s: 10, onset_s: 5, whole: [lines, lines] });
  assert.equal(held.flight.count, held.WHOLE);
  assert.deepEqual(held.at(0, 4), { faulted: 1, mirror: 1 });
  assert.deepEqual(held.at(0, null), { faulted: 3, mirror: 1 });
  assert.equal(held.at(0, 12.5), null);
  held.refine([lines, [packed([0, 9, 10]), packed([1, 2, 4]), packed([1, 1, 1])]]);
  assert.deepEqual(held.mean(1, 9.5), { faulted: 3, mirror: 1 });
  held.refine(null);
  assert.deepEqual(held.rows(1)[0], [0, 10]);
});

test("readings are shown in the unit chosen, differences without its offset", () => {
  const other = {
    quantity: "temperature",
    factor: 5 / 9,
    offset: -160 / 9,
    label: "°C",
    extra_decimals: 0,
  };
  const scale = { limits: [], gauge: null, resting: 0, quiet: 1, still: 1, decimals: 0 };
  const spec = { name: "OAT", label: "Outside air", unit: "°F", ...scale, other };
  assert.equal(shown(spec).label, "°F");
  chooseUnits(["temperature"]);
  const { value, difference, label } = shown(spec);
  assert.equal(label, "°C");
  assert.ok(Math.abs(value(212) - 100) < 1e-9);
  assert.ok(Math.abs(difference(9) - 5) < 1e-9);
});

test("the answer at a time is the newest window's that had ended", () => {
  assert.deepEqual(
    [29, 30, 34.9, 99].map((at) => windowAt([30, 35, 40], at)),
    [-1, 0, 0, 2],
  );
});

test("labels of an axis have the digits that tell them apart", () => {
  assert.equal(tickLabel(-0.5, [-0.5, 0, 0.5]), "−0.5");
  assert.equal(tickLabel(1000, [1000, 1500]), "1000");
  assert.equal(tickLabel(0.25, [0.25, 0.3]), "0.25");
});

test("buttons apply to the runs that are chosen and seen", () => {
  const rows = [
    { id: "a", status: "done" },
    { id: "b", status: "done" },
  ];
  const [ids, hidden, compare, , , unfit, , , zip, , csv] = chosen(rows, rows.slice(0, 1));
  assert.deepEqual(
    [ids, hidden, compare],
    [["a"], "1 more selected, hidden by the filter", "Compare 1"],
  );
  assert.deepEqual([unfit, zip, csv], [false, "/runs/files?id=a", "/runs/a/faulted.csv"]);
  assert.equal(chosen([{ id: "b", status: "failed" }], [{ id: "b", status: "failed" }])[5], true);
  assert.deepEqual(search(null, { rows: 1 }), { rows: 1, quickFilterText: "" });
});
