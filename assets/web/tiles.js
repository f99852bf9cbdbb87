// The 23 channel tiles: both flights above, their residual below, drawn by uPlot on canvas.
//
// One cursor and one zoom serve all tiles (`cursor.js` keeps them); the samples are in `flight.js`.
// Tiles in view are drawn at once, the others as soon as the browser has nothing better to do.
// Colours come from `style.css`.

(function () {
  "use strict";

  const AXIS_WIDTH = 46;
  const SENSOR_HEIGHT = 90;
  const RESIDUAL_HEIGHT = 62;
  const TIME_AXIS_HEIGHT = 18;
  const TIME_STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600];
  const MIN_ZOOM_PX = 4;

  let tiles = [];
  let marks = [];
  let zoom = null;
  let cursor_s = null;
  let between = { a_s: null, b_s: null };

  const flight = () => window.dash_clientside.flight;
  const moment = () => window.dash_clientside.cursor;
  const span = () => zoom || { min: 0, max: flight().duration_s };

  const colours = new Map();

  function colour(name) {
    if (!colours.has(name)) {
      colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
    }
    return colours.get(name);
  }

  // ---- one tile -----------------------------------------------------------------------------

  class Tile {
    constructor(root, spec, index) {
      this.root = root;
      this.spec = spec;
      this.index = index;
      this.readout = document.getElementById(`readout-${index}`);
      this.between = document.getElementById(`between-${index}`);
      this.unit = root.closest(".tile").querySelector(".tile-unit");
      root.replaceChildren();
      const width = Math.max(root.clientWidth, 80);
      this.sensor = new uPlot(this.sensorOptions(width), [[], [], []], root);
      this.residual = new uPlot(this.residualOptions(width), [[], []], root);
      this.plots = [this.sensor, this.residual];
      this.plots.forEach(listen);
      this.resizing = new ResizeObserver(() => this.fit());
      this.resizing.observe(root);
      this.inView = true;
      this.seeing = new IntersectionObserver((sightings) => {
        this.inView = sightings[sightings.length - 1].isIntersecting;
        if (!this.inView) return;
        if (this.stale) this.draw();
        else this.showCursor();
      });
      this.seeing.observe(root);
    }

    sensorOptions(width) {
      return {
        ...commonOptions(width, SENSOR_HEIGHT),
        axes: [timeAxis(false), valueAxis(26)],
        scales: {
          x: { time: false },
          y: {
            range: (plot, low, high) => {
              const { value, difference } = flight().shown(this.spec);
              return padded(low, high, value(this.around()), difference(this.spec.quiet));
            },
          },
        },
        series: [{}, line("--mirror", 3), line("--faulted", 1.3)],
        hooks: {
          draw: [(plot) => this.drawLimits(plot), (plot) => this.drawMoments(plot)],
          setSelect: [zoomToSelection],
        },
      };
    }

    residualOptions(width) {
      return {
        ...commonOptions(width, RESIDUAL_HEIGHT),
        axes: [timeAxis(true), valueAxis(14)],
        scales: {
          x: { time: false },
          y: {
            range: (plot, low, high) =>
              padded(low, high, 0, flight().shown(this.spec).difference(this.spec.still)),
          },
        },
        series: [{}, line("--residual", 1.3)],
        hooks: { draw: [(plot) => this.drawMoments(plot)], setSelect: [zoomToSelection] },
      };
    }

    // The value that a quiet channel is centred on.
    around() {
      const mirror = flight().rows(this.index)[2];
      return mirror.length ? mirror[0] : this.spec.resting;
    }

    draw() {
      this.stale = false;
      let [time, faulted, mirror] = flight().rows(this.index);
      const { value, label, converted } = flight().shown(this.spec);
      if (converted) [faulted, mirror] = [faulted.map(value), mirror.map(value)];
      const residual = faulted.map((reading, at) => reading - mirror[at]);
      for (const [plot, data] of [
        [this.sensor, [time, mirror, faulted]],
        [this.residual, [time, residual]],
      ]) {
        plot.batch(() => {
          plot.setData(data, true);
          plot.setScale("x", span());
        });
      }
      this.root.dataset.samples = time.length;
      if (this.unit.textContent !== label) this.unit.textContent = label;
      this.showCursor();
      this.showBetween();
    }

    // The line at the cursor and the reading there; without one, the latest reading.
    showCursor() {
      this.showReading();
      for (const plot of this.plots) {
        if (plot.over.matches(":hover")) continue;
        const left = cursor_s === null ? -10 : plot.valToPos(cursor_s, "x");
        if (Math.abs(left - plot.cursor.left) > 0.1) plot.setCursor({ left, top: 1 }, false, false);
      }
      this.root.dataset.cursorS = cursor_s ?? "";
    }

    showReading() {
      const { difference, value, decimals } = flight().shown(this.spec);
      const read = flight().at(this.index, cursor_s);
      const { number, signed } = flight();
      this.readout.textContent = read
        ? `${number(value(read.faulted), decimals)}  Δ ` +
          signed(difference(read.faulted - read.mirror), decimals)
        : "";
    }

    // How far and how fast the reading goes from A to B.
    showBetween() {
      const { a_s, b_s } = between;
      if (a_s === null || b_s === null || a_s === b_s || b_s > flight().flownUntil() + 1) {
        this.between.textContent = "";
        return;
      }
      const [a, b] = [a_s, b_s].map((time_s) => flight().mean(this.index, time_s));
      if (!a || !b) return;
      const { difference, decimals } = flight().shown(this.spec);
      const { signed } = flight();
      const gone = difference(b.faulted - a.faulted);
      const perMinute = (60 * gone) / (b_s - a_s);
      this.between.textContent =
        `A→B ${signed(gone, decimals)}  ${signed(perMinute, decimals + 1)}/min`;
    }

    drawLimits(plot) {
      const { value } = flight().shown(this.spec);
      for (const limit of this.spec.limits.map(value)) {
        const { min, max } = plot.scales.y;
        if (limit < min || limit > max) continue;
        const y = Math.round(plot.valToPos(limit, "y", true)) + 0.5;
        stroke(plot, "--bad", [], [plot.bbox.left, y], [plot.bbox.left + plot.bbox.width, y]);
      }
    }

    // Onset, first evidence, first right answer; where this channel is beyond its limits; A and B.
    drawMoments(plot) {
      for (const mark of marks) {
        if (mark.kind === "onset") drawMoment(plot, mark.time_s, "--onset", [3, 3]);
        else if (mark.kind !== "limit") drawFlag(plot, mark);
        else if (mark.channel === this.spec.name) drawExcess(plot, mark);
      }
      for (const time_s of [between.a_s, between.b_s]) drawMoment(plot, time_s, "--ink", []);
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
      this.plots.forEach((plot) => plot.destroy());
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
        bind: {
          dblclick: () => () => moment().zoomTo(null),
          mousedown: (plot, target, drag) => (event) => (event.shiftKey ? pan(plot, event) : drag(event)),
        },
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
      values: (plot, splits) => splits.map((time_s) => (labelled ? flight().clock(time_s) : "")),
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
    return flight().number(value, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
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

  // ---- marks --------------------------------------------------------------------------------

  function drawMoment(plot, time_s, variable, dash) {
    if (time_s === null) return;
    const x = Math.round(plot.valToPos(time_s, "x", true)) + 0.5;
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return;
    stroke(plot, variable, dash, [x, top], [x, top + height]);
  }

  // A small flag at the top: these moments are the whole flight's, not this channel's.
  function drawFlag(plot, { kind, time_s }) {
    const x = plot.valToPos(time_s, "x", true);
    const { left, top, width } = plot.bbox;
    if (x < left || x > left + width) return;
    const side = 3.5 * devicePixelRatio;
    const { ctx } = plot;
    ctx.save();
    ctx.fillStyle = colour(`--mark-${kind}`);
    ctx.beginPath();
    ctx.moveTo(x - side, top);
    ctx.lineTo(x + side, top);
    ctx.lineTo(x, top + 2 * side);
    ctx.fill();
    ctx.restore();
  }

  // A red bar along the foot of the plot for as long as the limit was exceeded.
  function drawExcess(plot, { time_s, end_s }) {
    const { left, top, width, height } = plot.bbox;
    const inside = (x) => Math.min(Math.max(x, left), left + width);
    const [from, to] = [time_s, end_s].map((at_s) => inside(plot.valToPos(at_s, "x", true)));
    if (to <= left || from >= left + width) return;
    plot.ctx.save();
    plot.ctx.fillStyle = colour("--bad");
    const thick = 3 * devicePixelRatio;
    plot.ctx.fillRect(from, top + height - thick, Math.max(to - from, 2 * devicePixelRatio), thick);
    plot.ctx.restore();
  }

  function stroke(plot, variable, dash, from, to) {
    const { ctx } = plot;
    ctx.save();
    ctx.strokeStyle = colour(variable);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(dash.map((length) => length * devicePixelRatio));
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(...to);
    ctx.stroke();
    ctx.restore();
  }

  // ---- pointer ------------------------------------------------------------------------------

  // The plot that the pointer is over speaks for all.
  function listen(plot) {
    plot.over.addEventListener("mousemove", (event) => {
      if (plot.data[0].length) moment().point(plot.posToVal(event.clientX - plot.rect.left, "x"));
    });
    plot.over.addEventListener("mouseleave", () => moment().point(null));
  }

  function zoomToSelection(plot) {
    const { left, width } = plot.select;
    if (width < MIN_ZOOM_PX) return;
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    moment().zoomTo({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
  }

  // Shift and drag: the zoomed span goes with the pointer.
  function pan(plot, event) {
    if (!zoom || event.button !== 0) return;
    const begun = { x: event.clientX, ...zoom };
    const perPixel = (zoom.max - zoom.min) / plot.over.clientWidth;
    const follow = (moved) => moment().panTo(begun.min - (moved.clientX - begun.x) * perPixel);
    document.addEventListener("mousemove", follow);
    document.addEventListener("mouseup", () => document.removeEventListener("mousemove", follow), { once: true });
  }

  // ---- called by cursor.js ------------------------------------------------------------------

  function moveCursor(time_s) {
    cursor_s = time_s;
    for (const tile of tiles) {
      if (tile.inView && !tile.stale) tile.showCursor();
      else tile.showReading();
    }
  }

  function showZoom(to) {
    zoom = to;
    redraw((tile) => tile.plots.forEach((plot) => plot.setScale("x", span())));
    document.dispatchEvent(new CustomEvent("zoomchanged", { detail: to }));
  }

  function showMarks(found) {
    marks = found;
    redraw(redrawPlots);
  }

  function showBetween(a_s, b_s) {
    between = { a_s, b_s };
    for (const tile of tiles) tile.showBetween();
    redraw(redrawPlots);
  }

  const redrawPlots = (tile) => tile.plots.forEach((plot) => plot.redraw(false, true));

  // ---- called by Dash -----------------------------------------------------------------------

  function build(specs) {
    if (tiles.length && tiles.every((tile) => tile.root.isConnected)) return;
    tiles.forEach((tile) => tile.destroy());
    flight().describe(specs);
    tiles = specs.map((spec, index) => new Tile(document.getElementById(`tile-${index}`), spec, index));
  }

  // What is in view changes at once, the rest when the browser has time.
  function redraw(change) {
    for (const tile of tiles) {
      if (tile.inView && !tile.stale) change(tile);
      else tile.stale = true;
    }
    drawStaleWhenIdle();
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

  // Draws a message and returns how much of which flight the page now holds.
  function showFlight(message, specs) {
    if (!message || !specs || !document.getElementById("tile-0")) return { key: null, count: 0 };
    const planned_s = flight().duration_s;
    const begins = flight().take(message);
    build(specs);
    for (const tile of tiles) tile.stale = true;
    if (begins) moment().begin();
    else if (flight().duration_s !== planned_s) moment().zoomTo(null);
    for (const tile of tiles) if (tile.inView) tile.draw();
    drawStaleWhenIdle();
    document.dispatchEvent(new CustomEvent("flightchanged"));
    return { key: flight().key, count: flight().count };
  }

  const refresh = () => redraw((tile) => tile.draw());

  document.addEventListener("unitschanged", refresh);

  new MutationObserver(() => {
    colours.clear();
    redraw(redrawPlots);
  }).observe(document.documentElement, {
    attributes: true,
    attributeFilter: ["data-mantine-color-scheme"],
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    tiles: { showFlight, refresh, moveCursor, showZoom, showMarks, showBetween },
  });
})();
