// The units that the reader has chosen. Conversions come from `core/units.py` with each channel.

import { byId } from "../kit/page.js";
import { unitsChanged } from "./changes.js";
import { describe, specs } from "./flight.js";

/** @typedef {import("./flight.js").Spec} Spec */

/** @type {Set<string>} */
let chosen = new Set();

const asLogged = (/** @type {number} */ logged) => logged;

/**
 * How to show a channel in the unit chosen for its quantity.
 * @param {Spec} spec
 */
export function shown(spec) {
  const { other } = spec;
  if (!other || !chosen.has(other.quantity)) {
    const { unit: label, decimals } = spec;
    return { value: asLogged, difference: asLogged, label, decimals, converted: false };
  }
  return {
    value: (/** @type {number} */ logged) => logged * other.factor + other.offset,
    difference: (/** @type {number} */ logged) => logged * other.factor,
    label: other.label,
    decimals: Math.max(0, spec.decimals + other.extra_decimals),
    converted: true,
  };
}

/**
 * Takes the choice; returns what its button says.
 * @param {string[]} quantities
 */
export function chooseUnits(quantities) {
  chosen = new Set(quantities);
  unitsChanged.send();
  return unitNames();
}

/** One unit of each quantity, the plainest: "ft" stands for "ft/min" too. */
function unitNames() {
  /** @type {Record<string, string>} */
  const units = {};
  for (const spec of specs) {
    if (!spec.other) continue;
    const { label } = shown(spec);
    const { quantity } = spec.other;
    if (!units[quantity] || label.length < units[quantity].length) units[quantity] = label;
  }
  return specs.length ? `Units: ${Object.values(units).join(" · ")}` : "Units";
}

/**
 * Takes how the channels are shown.
 * @param {Spec[]} channels
 */
export function takeSpecs(channels) {
  describe(channels);
  const button = byId("units-chosen");
  if (button) button.textContent = unitNames();
}
