// The flight that the page shows: its samples, as the browser holds them, and what they read at a
// moment, in the units that the reader has chosen. `tiles.js` and `engine.js` draw from here.
//
// Samples come from `app/figures/streamed.py` and `sensors.py` as float32 in base64, those of a part
// that was zoomed into from `detail.js`, conversions from `core/units.py`.

(function () {
  "use strict";

  const MEAN_OVER_S = 2;

  let flight = emptyFlight({ key: null, run: null, duration_s: 300, onset_s: null });
  let specs = [];
  let chosen = new Set();

  function emptyFlight({ key, run, duration_s, onset_s }) {
    return { key, run, duration_s, onset_s, count: 0, channels: [], extremes: [], finer: null, drawn: [] };
  }

  function floats(base64) {
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    // Not by `Uint8Array.from`, which takes ten times as long for its call a byte.
    for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
    return new Float32Array(bytes.buffer);
  }

  // ---- samples ------------------------------------------------------------------------------

  // Takes a message; returns whether it began another flight.
  function take(message) {
    const begins = message.key !== flight.key || (message.start ?? 0) > flight.count;
    if (begins) flight = emptyFlight(message);
    flight.onset_s = message.onset_s; // in a live flight it comes when it comes
    flight.duration_s = message.duration_s; // the ground may end it before its plan does
    flight.drawn = [];
    if (message.whole) replace(message);
    else if (message.time_s && message.start <= flight.count) extend(message);
    return begins;
  }

  // Samples from `start` on, for all channels; whatever was there from `start` on is replaced.
  function extend(message) {
    const time = floats(message.time_s);
    const faulted = floats(message.faulted);
    const mirror = floats(message.mirror);
    const n = time.length;
    const channelCount = faulted.length / n;
    for (let index = 0; index < channelCount; index++) {
      const before = flight.channels[index] || [[], [], []];
      const own = index * n;
      flight.channels[index] = [time, faulted.subarray(own, own + n), mirror.subarray(own, own + n)]
        .map((values, row) => before[row].slice(0, message.start).concat(Array.from(values)));
    }
    flight.count = message.start + n;
    extendExtremes(message);
  }

  // The extremes of every stretch of the flight from `group` on, six samples of each stretch.
  function extendExtremes({ group, extremes }) {
    const rows = extremes.map(floats);
    const n = rows[0].length / flight.channels.length;
    flight.channels.forEach((_, index) => {
      const before = flight.extremes[index] || [[], [], []];
      flight.extremes[index] = rows.map((values, row) =>
        before[row].slice(0, 6 * group).concat(Array.from(values.subarray(index * n, (index + 1) * n))));
    });
  }

  function replace(message) {
    flight.channels = unpacked(message.whole);
    flight.extremes = [];
    flight.count = Number.MAX_SAFE_INTEGER;
  }

  const unpacked = (channels) => channels.map((rows) => rows.map((row) => Array.from(floats(row))));

  // A part of the flight in finer samples, as long as it is looked at closely; null: none any more.
  function refine(whole) {
    flight.finer = whole && unpacked(whole);
    flight.drawn = [];
  }

  // ---- what is drawn ------------------------------------------------------------------------

  // Time, faulted and mirror of a channel, as fine as they are here.
  function rows(index) {
    if (!flight.channels[index]) return [[], [], []];
    if (!flight.drawn[index]) {
      const coarse = merged(flight.channels[index], flight.extremes[index]);
      flight.drawn[index] = flight.finer ? patched(coarse, flight.finer[index]) : coarse;
    }
    return flight.drawn[index];
  }

  // Two lists of samples as one, in order of time, each sample once.
  function merged(one, other) {
    if (!other || !other[0].length) return one;
    const both = [[], [], []];
    let [from, last] = [0, -1];
    const take = (rows, at) => {
      if (rows[0][at] > last) both.forEach((row, place) => row.push(rows[place][at]));
      last = Math.max(last, rows[0][at]);
    };
    for (let at = 0; at < one[0].length; at++) {
      while (from < other[0].length && other[0][from] < one[0][at]) take(other, from++);
      take(one, at);
    }
    while (from < other[0].length) take(other, from++);
    return both;
  }

  // The finer samples in the place of the coarse ones that lie among them.
  function patched(coarse, finer) {
    const [time] = finer;
    if (!time.length) return coarse;
    const from = rowAfter(coarse[0], time[0]);
    const to = rowAfter(coarse[0], time[time.length - 1] + 1e-3);
    return coarse.map((row, place) => row.slice(0, from).concat(finer[place], row.slice(to)));
  }

  // The latest time that there is something to see of.
  function flownUntil() {
    const [time] = rows(0);
    return time.length ? time[time.length - 1] : 0;
  }

  // The first sample at or after a time.
  function rowAfter(time, time_s) {
    let low = 0;
    let high = time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // What a channel read at a time, or reads now (null); null where nothing has been flown.
  function at(index, time_s) {
    const [time, faulted, mirror] = rows(index);
    const last = time.length - 1;
    if (last < 0 || (time_s !== null && time_s > time[last] + MEAN_OVER_S)) return null;
    let row = time_s === null ? last : Math.min(rowAfter(time, time_s), last);
    if (row > 0 && time_s !== null && time_s - time[row - 1] < time[row] - time_s) row -= 1;
    return { faulted: faulted[row], mirror: mirror[row] };
  }

  // The mean over 2 s around a time: two samples compared would compare their noise, and drawn
  // samples are the extreme ones.
  function mean(index, time_s) {
    const [time, faulted, mirror] = rows(index);
    const from = rowAfter(time, time_s - MEAN_OVER_S / 2);
    const to = rowAfter(time, time_s + MEAN_OVER_S / 2);
    if (to <= from) return at(index, time_s);
    const average = (row) => row.slice(from, to).reduce((sum, value) => sum + value, 0) / (to - from);
    return { faulted: average(faulted), mirror: average(mirror) };
  }

  // ---- units and text -----------------------------------------------------------------------

  const AS_LOGGED = { value: (logged) => logged, difference: (logged) => logged };

  // How to show a channel in the unit chosen for its quantity.
  function shown(spec) {
    const { other } = spec;
    if (!other || !chosen.has(other.quantity)) {
      return { ...AS_LOGGED, label: spec.unit, decimals: spec.decimals, converted: false };
    }
    return {
      value: (logged) => logged * other.factor + other.offset,
      difference: (logged) => logged * other.factor,
      label: other.label,
      decimals: Math.max(0, spec.decimals + other.extra_decimals),
      converted: true,
    };
  }

  function clock(time_s) {
    const total = Math.round(time_s);
    const [hours, minutes, seconds] = [total / 3600, (total / 60) % 60, total % 60].map(Math.floor);
    const pad = (number) => String(number).padStart(2, "0");
    return hours ? `${hours}:${pad(minutes)}:${pad(seconds)}` : `${minutes}:${pad(seconds)}`;
  }

  // With a minus sign, not a hyphen, and never "minus nothing".
  function number(value, decimals) {
    const text = value.toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
  }

  function signed(value, decimals) {
    const text = number(value, decimals);
    return text.startsWith("−") ? text : `+${text}`;
  }

  function chooseUnits(quantities) {
    chosen = new Set(quantities);
    document.dispatchEvent(new CustomEvent("unitschanged"));
    return unitNames();
  }

  // One unit of each quantity, the plainest: "ft" stands for "ft/min" too.
  function unitNames() {
    const units = {};
    for (const spec of specs) {
      if (!spec.other) continue;
      const { label } = shown(spec);
      const { quantity } = spec.other;
      if (!units[quantity] || label.length < units[quantity].length) units[quantity] = label;
    }
    return specs.length ? `Units: ${Object.values(units).join(" · ")}` : "Units";
  }

  function describe(channels) {
    specs = channels;
    const button = document.getElementById("units-chosen");
    if (button) button.textContent = unitNames();
  }

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    flight: {
      take, refine, rows, at, mean, flownUntil, describe, shown, chooseUnits, clock, number, signed,
      get specs() { return specs; },
      get run() { return flight.run; },
      get key() { return flight.key; },
      get count() { return flight.count; },
      get duration_s() { return flight.duration_s; },
      get onset_s() { return flight.onset_s; },
    },
  });
})();
