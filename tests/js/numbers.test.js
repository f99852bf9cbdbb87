import assert from "node:assert/strict";
import { test } from "node:test";

import {
  narrow,
  number,
  readNumber,
  signed,
  withoutUnit,
} from "../../assets/web/modules/kit/numbers.js";

test("readings have a minus sign, and none for nothing", () => {
  assert.deepEqual(
    [number(-1.25, 1), number(-0.04, 1), number(3, 0), signed(-2, 0), signed(0.04, 1)],
    ["−1.3", "0.0", "3", "−2", "+0.0"],
  );
});

test("numbers are read as people write them", () => {
  const written = {
    1234.5: "1234.5",
    ".5": ".5",
    "1,234": "1234",
    "1,234,567.8": "1234567.8",
    "1 234,5": "1234.5",
    "1\u202f234": "1234",
    "1'234'567.8": "1234567.8",
    "1.234.567": "1234567",
    "1.234,5": "1234.5",
    "0,8": "0.8",
    "+7": "7",
    "−3": "-3",
    "–3": "-3",
    "１２": "12",
  };
  for (const [text, read] of Object.entries(written)) assert.equal(readNumber(text), read, text);
});

test("what may mean two things, or nothing, is no number", () => {
  for (const text of ["1e3", "", "abc", "1,23,456", "1 23", "--1", "0x10", "1.2.3", "12 ft"]) {
    assert.equal(readNumber(text), null, text);
  }
});

test("a unit may follow, and some take no fraction", () => {
  assert.equal(readNumber("4,500 ft", { unit: "ft" }), "4500");
  assert.equal(readNumber("12.0", { whole: true }), "12");
  assert.equal(readNumber("12.5", { whole: true }), null);
  assert.equal(readNumber("99999999999999999999", { whole: true }), null);
  assert.equal(withoutUnit(" 5 kt ", "kt"), "5");
  assert.equal(narrow("１，５"), "1,5");
});
