// The 23 channel tiles: both flights above, their residual below, drawn by uPlot on canvas.
//
// One cursor and one zoom serve all tiles. Tiles in view are drawn at once, the others as soon as the
// browser has nothing better to do. What is drawn comes from `app/panels/sensors.py`, as
// float32 in base64; colours come from `style.css`.

(function () {
  "use strict";

  const AXIS_WIDTH = 46;
  const SENSOR_HEIGHT = 90;
  const RESIDUAL_HEIGHT = 62;
  const TIME_AXIS_HEIGHT = 18;
  const TIME_STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];
  const MIN_ZOOM_PX = 4;

  let tiles = [];
  let flight = emptyFlight(null, 300, null);
  let zoom = null;

  // ---- data ---------------------------------------------------------------------------------

  function emptyFlight(key, duration_s, onset_s) {
    return { key, duration_s, onset_s, count: 0, channels: [] };
  }

  function floats(base64) {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }

  // Samples from `start` on, for all channels; whatever was there from `start` on is replaced.
  function extendFlight(message) {
    const time = floats(message.time_s);
    const faulted = floats(message.faulted);
    const mirror = floats(message.mirror);
    const n = time.length;
    const total = message.start + n;
    const channelCount = faulted.length / n;
    for (let index = 0; index < channelCount; index++) {
      const before = flight.channels[index] || [[], [], []];
      const own = index * n;
      flight.channels[index] = [time, faulted.subarray(own, own + n), mirror.subarray(own, own + n)]
        .map((values, row) => before[row].slice(0, message.start).concat(Array.from(values)));
    }
    flight.count = total;
  }

  function replaceFlight(message) {
    flight.channels = message.whole.map((rows) => rows.map((row) => Array.from(floats(row))));
    flight.count = Number.MAX_SAFE_INTEGER;
  }

  // ---- text ---------------------------------------------------------------------------------

  function clock(time_s) {
    const total = Math.round(time_s);
    const [hours, minutes, seconds] = [total / 3600, (total / 60) % 60, total % 60].map(Math.floor);
    const pad = (number) => String(number).padStart(2, "0");
    return hours ? `${hours}:${pad(minutes)}:${pad(seconds)}` : `${pad(minutes)}:${pad(seconds)}`;
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

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // ---- one tile -----------------------------------------------------------------------------

  class Tile {
    constructor(root, spec, index) {
      this.root = root;
      this.spec = spec;
      this.index = index;
      this.readout = document.getElementById(`readout-${index}`);
      root.replaceChildren();
      const width = Math.max(root.clientWidth, 80);
      this.sensor = new uPlot(this.sensorOptions(width), [[], [], []], root);
      this.residual = new uPlot(this.residualOptions(width), [[], []], root);
      this.resizing = new ResizeObserver(() => this.fit());
      this.resizing.observe(root);
      this.inView = true;
      this.seeing = new IntersectionObserver((sightings) => {
        this.inView = sightings[sightings.length - 1].isIntersecting;
        if (this.inView && this.stale) this.draw();
      });
      this.seeing.observe(root);
    }

    sensorOptions(width) {
      return {
        ...commonOptions(width, SENSOR_HEIGHT),
        axes: [timeAxis(false), valueAxis(26)],
        scales: {
          x: { time: false },
          y: { range: (plot, low, high) => padded(low, high, this.around(), this.spec.quiet) },
        },
        series: [{}, line("--mirror", 3), line("--faulted", 1.3)],
        hooks: {
          draw: [(plot) => this.drawLimits(plot), drawOnset],
          setSelect: [zoomToSelection],
          setCursor: [() => this.readAt(this.sensor.cursor.idx), () => this.announceCursor()],
        },
      };
    }

    residualOptions(width) {
      return {
        ...commonOptions(width, RESIDUAL_HEIGHT),
        axes: [timeAxis(true), valueAxis(14)],
        scales: {
          x: { time: false },
          y: { range: (plot, low, high) => padded(low, high, 0, this.spec.still) },
        },
        series: [{}, line("--residual", 1.3)],
        hooks: { draw: [drawOnset], setSelect: [zoomToSelection] },
      };
    }

    // The value that a quiet channel is centred on.
    around() {
      const rows = flight.channels[this.index];
      return rows && rows[2].length ? rows[2][0] : this.spec.resting;
    }

    draw() {
      this.stale = false;
      const [time, faulted, mirror] = flight.channels[this.index] || [[], [], []];
      const residual = faulted.map((value, at) => value - mirror[at]);
      this.latest = time.length - 1;
      const span = zoom || { min: 0, max: flight.duration_s };
      for (const [plot, data] of [
        [this.sensor, [time, mirror, faulted]],
        [this.residual, [time, residual]],
      ]) {
        plot.batch(() => {
          plot.setData(data, true);
          plot.setScale("x", span);
        });
      }
      this.root.dataset.samples = time.length;
      this.readAt(null);
    }

    // The value under the cursor, or the latest one.
    readAt(at) {
      const [time, mirror, faulted] = this.sensor.data;
      const shown = at === null || at === undefined ? this.latest : at;
      if (!(shown >= 0) || faulted[shown] === undefined) {
        this.readout.textContent = "";
        return;
      }
      const { decimals } = this.spec;
      const difference = faulted[shown] - mirror[shown];
      this.readout.textContent =
        `${number(faulted[shown], decimals)}  Δ ${signed(difference, decimals)}`;
    }

    // The one that the pointer is over speaks for all.
    announceCursor() {
      if (movingCursor || !this.sensor.over.matches(":hover")) return;
      const { left } = this.sensor.cursor;
      const time_s = left >= 0 ? this.sensor.posToVal(left, "x") : null;
      document.dispatchEvent(new CustomEvent("tilescursor", { detail: time_s }));
    }

    moveCursor(time_s) {
      const left = time_s === null ? -10 : this.sensor.valToPos(time_s, "x");
      for (const plot of [this.sensor, this.residual]) plot.setCursor({ left, top: 1 }, true, false);
    }

    drawLimits(plot) {
      for (const limit of this.spec.limits) {
        const { min, max } = plot.scales.y;
        if (limit < min || limit > max) continue;
        const y = Math.round(plot.valToPos(limit, "y", true)) + 0.5;
        stroke(plot, colour("--bad"), [], [plot.bbox.left, y], [plot.bbox.left + plot.bbox.width, y]);
      }
    }

    fit() {
      const width = this.root.clientWidth;
      if (width < 80 || width === this.sensor.width) return;
      this.sensor.setSize({ width, height: SENSOR_HEIGHT });
      this.residual.setSize({ width, height: RESIDUAL_HEIGHT });
    }

    destroy() {
      this.resizing.disconnect();
      this.seeing.disconnect();
      this.sensor.destroy();
      this.residual.destroy();
    }
  }

  // ---- uPlot options ------------------------------------------------------------------------

  function commonOptions(width, height) {
    return {
      width,
      height,
      padding: [4, 16, height === SENSOR_HEIGHT ? 6 : 0, 0],
      legend: { show: false },
      cursor: {
        y: false,
        points: { size: 5 },
        drag: { x: true, y: false, setScale: false },
        sync: { key: "flight", filters: { pub: (type) => type.startsWith("mousemove") } },
        bind: { dblclick: () => () => zoomTo(null) },
      },
    };
  }

  function timeAxis(labelled) {
    return {
      size: labelled ? TIME_AXIS_HEIGHT : 0,
      gap: 3,
      space: 56,
      font: axisFont(),
      incrs: TIME_STEPS_S,
      stroke: () => colour("--ink-2"),
      grid: { stroke: () => colour("--grid"), width: 1 },
      ticks: { show: false },
      values: (plot, splits) => splits.map((time_s) => (labelled ? clock(time_s) : "")),
    };
  }

  function valueAxis(space) {
    return {
      size: AXIS_WIDTH,
      gap: 4,
      space,
      font: axisFont(),
      stroke: () => colour("--ink-2"),
      grid: { stroke: () => colour("--grid"), width: 1 },
      ticks: { show: false },
      values: (plot, splits) => splits.map((value) => tick(value, splits)),
    };
  }

  const axisFont = () => `10px ${getComputedStyle(document.body).fontFamily}`;

  function tick(value, splits) {
    const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) : Math.abs(value) || 1;
    return number(value, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  }

  function line(variable, width) {
    return { stroke: () => colour(variable), width, points: { show: false } };
  }

  // The range of the data, but never so narrow that mere noise fills the tile.
  function padded(low, high, centre, span) {
    const from = Math.min(low ?? centre, centre - span);
    const to = Math.max(high ?? centre, centre + span);
    const margin = 0.06 * (to - from);
    return [from - margin, to + margin];
  }

  function drawOnset(plot) {
    if (flight.onset_s === null) return;
    const x = Math.round(plot.valToPos(flight.onset_s, "x", true)) + 0.5;
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return;
    stroke(plot, colour("--onset"), [3, 3], [x, top], [x, top + height]);
  }

  function stroke(plot, style, dash, from, to) {
    const { ctx } = plot;
    ctx.save();
    ctx.strokeStyle = style;
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(dash.map((length) => length * devicePixelRatio));
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(...to);
    ctx.stroke();
    ctx.restore();
  }

  // ---- zoom ---------------------------------------------------------------------------------

  function zoomToSelection(plot) {
    const { left, width } = plot.select;
    if (width < MIN_ZOOM_PX) return;
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    zoomTo({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
  }

  function zoomTo(span) {
    zoom = span;
    const shown = zoom || { min: 0, max: flight.duration_s };
    for (const tile of tiles) {
      tile.sensor.setScale("x", shown);
      tile.residual.setScale("x", shown);
    }
  }

  // ---- called by Dash -----------------------------------------------------------------------

  function build(specs) {
    if (tiles.length && tiles.every((tile) => tile.root.isConnected)) return;
    tiles.forEach((tile) => tile.destroy());
    tiles = specs.map((spec, index) => new Tile(document.getElementById(`tile-${index}`), spec, index));
  }

  let idle = null;

  function drawStaleWhenIdle() {
    if (idle !== null || !tiles.some((tile) => tile.stale)) return;
    idle = requestIdleCallback(
      (deadline) => {
        idle = null;
        for (const tile of tiles) {
          if (!tile.stale) continue;
          tile.draw();
          if (deadline.timeRemaining() < 4) break;
        }
        drawStaleWhenIdle();
      },
      { timeout: 500 },
    );
  }

  let movingCursor = false;

  function moveCursor(time_s) {
    const span = zoom || { min: 0, max: flight.duration_s };
    if (time_s !== null && (time_s < span.min || time_s > span.max)) zoomTo(null);
    movingCursor = true;
    for (const tile of tiles) if (tile.inView) tile.moveCursor(time_s);
    movingCursor = false;
  }

  // The latest time that there is something to see of.
  function flownUntil() {
    const [time] = flight.channels[0] || [[]];
    return time.length ? time[time.length - 1] : 0;
  }

  // Draws a message and returns how much of which flight the page now holds.
  function showFlight(message, specs) {
    if (!message || !specs || !document.getElementById("tile-0")) return { key: null, count: 0 };
    if (message.key !== flight.key || (message.start ?? 0) > flight.count) {
      flight = emptyFlight(message.key, message.duration_s, message.onset_s);
      zoom = null;
    }
    if (message.whole) replaceFlight(message);
    else if (message.time_s && message.start <= flight.count) extendFlight(message);
    build(specs);
    for (const tile of tiles) {
      tile.stale = true;
      if (tile.inView) tile.draw();
    }
    drawStaleWhenIdle();
    return { key: flight.key, count: flight.count };
  }

  new MutationObserver(() => {
    for (const tile of tiles) {
      tile.sensor.redraw(false, true);
      tile.residual.redraw(false, true);
    }
  }).observe(document.documentElement, {
    attributes: true,
    attributeFilter: ["data-mantine-color-scheme"],
  });

  window.dash_clientside = window.dash_clientside || {};
  window.dash_clientside.tiles = { showFlight, moveCursor, flownUntil, clock };
})();
