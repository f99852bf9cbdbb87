// The charts of a mystery flight: one line a sensor, the mirror beside it once the server sends it.
// A click, or Enter at the cursor, asks which way the channel goes and reports the mark; the server
// keeps it. Nothing here knows more than what is drawn.

(function () {
  "use strict";

  const HEIGHT = 104;
  const MIN_ZOOM_PX = 4;
  const STEP_S = 5;
  const ARROWS = { "+": "▲", "-": "▼" };

  let charts = [];
  let flight = null;
  let marks = [];
  let zoom = null;
  let menu = null;

  const ungrouped = new Intl.NumberFormat("en", { useGrouping: false });
  const clock = (time_s) => window.dash_clientside.flight.clock(time_s);
  const setProps = (id, props) => window.dash_clientside.mirrortwin.setProps(id, props);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const isOver = () => document.getElementById("mystery")?.dataset.over === "yes";

  function floats(base64) {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    return Array.from(new Float32Array(bytes.buffer));
  }

  // ---- one chart ----------------------------------------------------------------------------

  class Chart {
    constructor(root, index) {
      this.root = root;
      this.index = index;
      this.spec = flight.specs[index];
      this.readout = document.getElementById(`mystery-readout-${index}`);
      root.replaceChildren();
      this.plot = new uPlot(this.options(Math.max(root.clientWidth, 80)), [[], [], []], root);
      this.plot.over.addEventListener("click", (event) => this.clicked(event));
      root.onkeydown = (event) => this.keyed(event);
      root.onblur = () => this.plot.setCursor({ left: -10, top: 0 });
      this.resizing = new ResizeObserver(() => {
        if (root.clientWidth >= 80) this.plot.setSize({ width: root.clientWidth, height: HEIGHT });
      });
      this.resizing.observe(root);
    }

    options(width) {
      const font = `10px ${getComputedStyle(document.body).fontFamily}`;
      const quiet = {
        font, gap: 4, ticks: { show: false },
        stroke: () => colour("--ink-2"),
        grid: { stroke: () => colour("--grid"), width: 1 },
      };
      const line = (name, lineWidth) => ({
        stroke: () => colour(name), width: lineWidth, points: { show: false },
      });
      return {
        width, height: HEIGHT, padding: [6, 14, 0, 0], legend: { show: false },
        cursor: {
          y: false, points: { size: 5 },
          drag: { x: true, y: false, setScale: false },
          sync: { key: "mystery", filters: { pub: (type) => type.startsWith("mousemove") } },
          bind: { dblclick: () => () => zoomTo(null) },
        },
        axes: [
          { ...quiet, size: 18, gap: 3, space: 56, incrs: [5, 10, 15, 30, 60, 120, 300],
            values: (plot, splits) => splits.map(clock) },
          { ...quiet, size: 46, space: 26, values: (plot, splits) => splits.map(ungrouped.format) },
        ],
        scales: { x: { time: false }, y: { range: (plot, low, high) => this.range(low, high) } },
        series: [{}, line("--mirror", 3), line("--faulted", 1.4)],
        hooks: {
          draw: [(plot) => this.drawMarks(plot)],
          setSelect: [zoomToSelection],
          setCursor: [() => this.read()],
        },
      };
    }

    // Never so narrow that mere noise fills the chart.
    range(low, high) {
      const around = this.plot && this.plot.data[2].length ? this.plot.data[2][0] : this.spec.resting;
      const from = Math.min(low ?? around, around - this.spec.quiet);
      const to = Math.max(high ?? around, around + this.spec.quiet);
      const margin = 0.06 * (to - from);
      return [from - margin, to + margin];
    }

    draw() {
      const [time, sensor, mirror] = flight.channels[this.index].map(floats);
      this.plot.batch(() => {
        this.plot.setData([time, mirror || time.map(() => null), sensor], true);
        this.plot.setScale("x", zoom || { min: 0, max: flight.duration_s });
      });
      this.root.dataset.samples = time.length;
      this.root.setAttribute("aria-valuemax", flight.duration_s);
      this.read();
    }

    read() {
      const [, , sensor] = this.plot.data;
      const at = this.plot.cursor.idx ?? sensor.length - 1;
      if (sensor[at] === undefined) return;
      this.readout.textContent = sensor[at].toFixed(this.spec.decimals).replace("-", "−");
      const time_s = this.time();
      this.root.setAttribute("aria-valuenow", Math.round(time_s));
      this.root.setAttribute(
        "aria-valuetext", `${clock(time_s)}: ${this.readout.textContent} ${this.spec.unit}`,
      );
    }

    time() {
      const { left } = this.plot.cursor;
      return left >= 0 ? this.plot.posToVal(left, "x") : 0;
    }

    moveTo(time_s) {
      const bounded = Math.min(Math.max(time_s, 0), flight.duration_s);
      if (zoom && (bounded < zoom.min || bounded > zoom.max)) zoomTo(null);
      this.plot.setCursor({ left: this.plot.valToPos(bounded, "x"), top: 1 });
    }

    clicked(event) {
      if (this.dragged || isOver()) return;
      openMenu(this, Math.max(0, this.plot.posToVal(event.offsetX, "x")), event.clientX, event.clientY);
    }

    keyed(event) {
      const steps = {
        ArrowLeft: -STEP_S, ArrowRight: STEP_S, ArrowDown: -STEP_S, ArrowUp: STEP_S,
        PageDown: -30, PageUp: 30, Home: -Infinity, End: Infinity,
      };
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key in steps) {
        this.moveTo(this.time() + steps[event.key]);
      } else if ((event.key === "Enter" || event.key === " ") && !isOver()) {
        const box = this.plot.over.getBoundingClientRect();
        openMenu(this, this.time(), box.left + Math.max(0, this.plot.cursor.left), box.top + 30);
      } else return;
      event.preventDefault();
    }

    drawMarks(plot) {
      if (flight.onset_s !== null) vertical(plot, flight.onset_s, "--onset", [3, 3]);
      for (const mark of marks) {
        if (mark.index !== this.index) continue;
        const x = vertical(plot, mark.time_s, "--ink", []);
        if (x === null) continue;
        plot.ctx.save();
        plot.ctx.fillStyle = colour("--ink");
        plot.ctx.font = `${11 * devicePixelRatio}px sans-serif`;
        plot.ctx.fillText(ARROWS[mark.direction], x + 3 * devicePixelRatio, plot.bbox.top + 11 * devicePixelRatio);
        plot.ctx.restore();
      }
    }

    destroy() {
      this.resizing.disconnect();
      this.plot.destroy();
    }
  }

  function vertical(plot, time_s, name, dash) {
    const x = Math.round(plot.valToPos(time_s, "x", true)) + 0.5;
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return null;
    const { ctx } = plot;
    ctx.save();
    ctx.strokeStyle = colour(name);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(dash.map((length) => length * devicePixelRatio));
    ctx.beginPath();
    ctx.moveTo(x, top);
    ctx.lineTo(x, top + height);
    ctx.stroke();
    ctx.restore();
    return x;
  }

  // ---- zoom ---------------------------------------------------------------------------------

  function zoomToSelection(plot) {
    const { left, width } = plot.select;
    const chart = charts.find((one) => one.plot === plot);
    if (chart) {
      // The click that ends a drag marks nothing.
      chart.dragged = width >= MIN_ZOOM_PX;
      setTimeout(() => { chart.dragged = false; });
    }
    if (width < MIN_ZOOM_PX) return;
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    zoomTo({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
  }

  function zoomTo(span) {
    zoom = span;
    for (const chart of charts) {
      chart.plot.setScale("x", zoom || { min: 0, max: flight.duration_s });
    }
  }

  // ---- marking ------------------------------------------------------------------------------

  function openMenu(chart, time_s, x, y) {
    closeMenu();
    menu = document.createElement("div");
    menu.className = "mark-menu panel";
    menu.setAttribute("role", "dialog");
    menu.setAttribute("aria-label", `Mark ${chart.root.dataset.label} at ${clock(time_s)}`);
    const title = document.createElement("p");
    title.textContent = `${chart.root.dataset.label} from ${clock(time_s)}`;
    menu.append(title);
    for (const [direction, word] of [["+", "▲ rises"], ["-", "▼ falls"]]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = word;
      button.onclick = () => {
        report({ channel: chart.root.dataset.channel, time_s, direction });
        closeMenu();
        chart.root.focus();
      };
      menu.append(button);
    }
    menu.onkeydown = (event) => {
      const buttons = [...menu.querySelectorAll("button")];
      const at = buttons.indexOf(document.activeElement);
      if (event.key === "Escape") { closeMenu(); chart.root.focus(); }
      else if (event.key.startsWith("Arrow")) buttons[(at + 1) % buttons.length].focus();
      else return;
      event.preventDefault();
    };
    document.body.append(menu);
    const { width, height } = menu.getBoundingClientRect();
    menu.style.left = `${Math.max(4, Math.min(x + 6, innerWidth - width - 4))}px`;
    menu.style.top = `${Math.max(4, Math.min(y + 6, innerHeight - height - 4))}px`;
    menu.querySelector("button").focus();
  }

  function closeMenu() {
    if (menu) menu.remove();
    menu = null;
  }

  // `at` makes the same mark twice two reports.
  function report(claim) {
    setProps("mystery-mark", { data: { ...claim, at: Date.now() } });
  }

  document.addEventListener("pointerdown", (event) => {
    if (menu && !menu.contains(event.target)) closeMenu();
  });

  document.addEventListener("click", (event) => {
    const button = event.target.closest(".mark-remove");
    if (button) report({ channel: button.dataset.channel, direction: null });
  });

  // ---- the clock ----------------------------------------------------------------------------

  let ticking = null;

  function tick() {
    const shown = document.getElementById("mystery-clock");
    if (!shown) return;
    if (ticking === null || ticking.shown !== shown) {
      ticking = { shown, begun: performance.now() - 1000 * Number(shown.dataset.elapsed) };
    }
    shown.textContent = clock((performance.now() - ticking.begun) / 1000);
  }

  setInterval(tick, 1000);

  // ---- called by Dash -----------------------------------------------------------------------

  function build() {
    if (charts.length && charts.every((chart) => chart.root.isConnected)) return;
    charts.forEach((chart) => chart.destroy());
    zoom = null;
    charts = flight.specs.map((spec, index) => new Chart(document.getElementById(`mystery-${index}`), index));
  }

  new MutationObserver(() => charts.forEach((chart) => chart.plot.redraw(false, true)))
    .observe(document.documentElement, {
      attributes: true, attributeFilter: ["data-mantine-color-scheme"],
    });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    teach: {
      draw(sent, put) {
        if (!sent || !document.getElementById("mystery-0")) return 0;
        const anew = sent !== flight;
        [flight, marks] = [sent, put || []];
        closeMenu();
        build();
        for (const chart of charts) anew ? chart.draw() : chart.plot.redraw(false, true);
        return charts.length;
      },
      // A name for this browser, so that it finds its own flights again.
      learner(stamp, known) {
        if (known) return known;
        const bytes = crypto.getRandomValues(new Uint8Array(16));
        return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
      },
    },
  });
})();
