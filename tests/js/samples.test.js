import assert from "node:assert/strict";
import { test } from "node:test";

import {
  extended,
  floats,
  merged,
  patched,
  rowAfter,
  rowNear,
  unpacked,
} from "../../assets/web/modules/kit/samples.js";

const packed = (/** @type {number[]} */ values) =>
  Buffer.from(Float32Array.from(values).buffer).toString("base64");

const lines = (/** @type {number[]} */ time) => [
  time,
  time.map((at) => 10 * at),
  time.map(() => 7),
];

test("floats are read as they were packed", () => {
  assert.deepEqual(Array.from(floats(packed([1.5, -2, 1e6]))), [1.5, -2, 1e6]);
  assert.deepEqual(unpacked([[packed([1]), packed([])]]), [[[1], []]]);
});

test("samples are put in the place of those from their start on", () => {
  const rows = [Float32Array.of(3, 4), Float32Array.of(30, 40)];
  const before = [
    [1, 2, 9],
    [10, 20, 90],
  ];
  assert.deepEqual(extended(before, 2, rows), [
    [1, 2, 3, 4],
    [10, 20, 30, 40],
  ]);
  assert.deepEqual(extended(undefined, 0, rows), [
    [3, 4],
    [30, 40],
  ]);
});

test("samples and extremes are merged in order of time, each once", () => {
  const [time, faulted] = merged(lines([0, 2, 4]), lines([1, 2, 3, 5, 6]));
  assert.deepEqual(time, [0, 1, 2, 3, 4, 5, 6]);
  assert.deepEqual(
    faulted,
    time.map((at) => 10 * at),
  );
});

test("nothing to merge leaves the samples as they are", () => {
  const one = lines([0, 1]);
  assert.equal(merged(one, undefined), one);
  assert.equal(merged(one, [[], [], []]), one);
});

test("a part in finer samples takes the place of the coarse ones in it", () => {
  const finer = lines([1.9, 2, 2.1, 4]);
  assert.deepEqual(patched(lines([0, 2, 4, 6]), finer)[0], [0, 1.9, 2, 2.1, 4, 6]);
  const coarse = lines([0, 2]);
  assert.equal(patched(coarse, [[], [], []]), coarse);
});

test("a time is looked up", () => {
  const time = [0, 1, 2, 4];
  assert.deepEqual(
    [-1, 0, 0.5, 4, 9].map((at) => rowAfter(time, at)),
    [0, 0, 1, 3, 4],
  );
  assert.deepEqual(
    [null, -1, 0.4, 0.6, 3.1, 9].map((at) => rowNear(time, at)),
    [3, 0, 0, 1, 3, 3],
  );
});
