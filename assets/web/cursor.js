// The time cursor: one moment of the flight, shown by all charts, readouts and 3D views at once. It
// is moved by pointing at a chart, by the slider under the flight path, by its keys, or by playing.
// Beside it: the cursors A and B, the marked moments, and the zoom that all charts share.
//
// `tiles.js`, `engine.js` and `ranking.js` show it; the server moves the aircraft of the live view.

(function () {
  "use strict";

  const ANNOUNCE_MS = 100;
  const REST_MS = 250;
  const FOLLOW_MS = 80;
  const AWAIT_MS = 200;
  const CHARTS = ["probabilities", "residual-strip"];
  const LEAST_SPAN_S = 2;
  const ZOOM_STEP = 0.5;
  const PAN_STEP = 0.25;

  let time_s = null; // null: nothing pointed at, the views show the latest
  let parked_s = null; // where it was put, and returns to
  let a_s = null;
  let b_s = null;
  let zoom = null; // null: the whole flight
  let told = [];
  let marks = [];
  let playing = null;
  let speed = 10;
  let due = null;
  let announced = null;
  let resting = null;
  let slid = 0; // the value of the slider in Dash
  let following = null;
  let awaiting = null;

  const tiles = () => window.dash_clientside.tiles;
  const flight = () => window.dash_clientside.flight;
  const setProps = (id, props) => window.dash_clientside.mirrortwin.setProps(id, props);
  const element = (id) => document.getElementById(id);
  const clock = (at_s) => flight().clock(at_s);

  // ---- following ----------------------------------------------------------------------------

  // However often it is moved, it is shown once a frame.
  function move(to_s) {
    parked_s = to_s;
    look(to_s);
  }

  // A pointer over a chart looks elsewhere for as long as it is there; not while the flight plays.
  function point(to_s) {
    if (playing === null) look(to_s ?? parked_s);
  }

  function look(at_s) {
    time_s = at_s;
    if (due === null) due = requestAnimationFrame(show);
  }

  function show() {
    due = null;
    if (zoom && time_s !== null && (time_s < zoom.min || time_s > zoom.max)) zoomTo(null);
    tiles().moveCursor(time_s);
    drawLines();
    showSlider();
    document.dispatchEvent(new CustomEvent("cursormoved", { detail: time_s }));
    if (announced === null) announced = setTimeout(announce, ANNOUNCE_MS);
    clearTimeout(resting);
    resting = setTimeout(rest, REST_MS);
  }

  // The slider as React will draw it once the cursor rests: each time costs it many milliseconds.
  function showSlider() {
    const thumb = document.querySelector("#scrub [role='slider']");
    if (!thumb) return;
    const at_s = time_s ?? flight().flownUntil();
    const share = (100 * at_s) / flight().duration_s;
    const bar = document.querySelector("#scrub .mantine-Slider-bar");
    thumb.style.setProperty("--slider-thumb-offset", `${share}%`);
    bar.style.setProperty("--slider-bar-width", `calc(${share}% + 2 * var(--slider-size))`);
    thumb.setAttribute("aria-valuetext", clock(at_s));
    element("scrub-time").textContent = clock(at_s);
  }

  function rest() {
    const at_s = time_s ?? flight().flownUntil();
    if (at_s === slid) return;
    slid = at_s;
    setProps("scrub", { value: at_s });
  }

  // The aircraft are moved by the server.
  function announce() {
    announced = null;
    setProps("cursor", { data: time_s });
    const replay = document.querySelector("#scene iframe[sandbox]");
    if (replay && time_s !== null) {
      replay.contentWindow.postMessage({ type: "seek", time_s }, "*");
    }
  }

  // ---- over the Plotly charts ---------------------------------------------------------------

  // The flight's time on Plotly's date axes: milliseconds inside, from midnight on, and dates as text
  // outside (`moment` in `app/figures/axes.py`). Never numbers outside: those are in the local time.
  const toInside = (at_s) => 1000 * at_s;
  const fromInside = (ms) => ms / 1000;

  function plotOf(id) {
    const plot = document.querySelector(`#${id} .js-plotly-plot`);
    return plot && plot._fullLayout && plot._fullLayout.xaxis ? plot : null;
  }

  // The cursor, A and B, and the marks other than the onset, which the figure has itself.
  function drawLines() {
    const lines = [["cursor", time_s], ["a", a_s], ["b", b_s]];
    for (const mark of marks) if (mark.kind !== "onset") lines.push([mark.kind, mark.time_s]);
    for (const plot of CHARTS.map(plotOf)) if (plot) placeLines(plot, lines);
  }

  function placeLines(plot, lines) {
    let layer = plot.querySelector(".time-lines");
    if (!layer) {
      layer = document.createElement("div");
      layer.className = "time-lines";
      plot.append(layer);
    }
    while (layer.children.length > lines.length) layer.lastChild.remove();
    while (layer.children.length < lines.length) layer.append(document.createElement("div"));
    const { _size: size, xaxis } = plot._fullLayout;
    Object.assign(layer.style, { left: `${xaxis._offset}px`, top: `${size.t}px`, height: `${size.h}px` });
    lines.forEach(([kind, at_s], place) => {
      const line = layer.children[place];
      const x = at_s === null ? NaN : xaxis.l2p(toInside(at_s));
      line.className = `${kind}-line`;
      line.hidden = !(x >= 0 && x <= xaxis._length);
      if (!line.hidden) line.style.transform = `translateX(${x}px)`;
    });
  }

  // Plotly comes when it comes, perhaps after the flight.
  function listenToCharts() {
    clearTimeout(awaiting);
    if (!element("scrub")) return;
    const plots = CHARTS.map(plotOf).filter((plot) => plot && plot.on);
    for (const plot of plots) listenTo(plot);
    if (plots.length < CHARTS.length) awaiting = setTimeout(listenToCharts, AWAIT_MS);
  }

  // Plotly tells where the pointer is by the trace under it, which a gap does not have.
  function listenTo(plot) {
    if (plot.listensToCursor) return;
    plot.listensToCursor = true;
    plot.addEventListener("pointermove", (event) => {
      const { xaxis } = plot._fullLayout;
      const x = event.clientX - plot.getBoundingClientRect().left - xaxis._offset;
      if (!event.buttons && x >= 0 && x <= xaxis._length) point(fromInside(xaxis.p2l(x)));
    });
    plot.addEventListener("pointerleave", () => point(null));
    plot.on("plotly_relayout", (change) => {
      const moved = Object.keys(change).some((name) => name.startsWith("xaxis.range"));
      if (moved && !plot.isFollowing) zoomTo(spanOf(plot));
    });
    plot.on("plotly_doubleclick", () => zoomTo(null));
    // A new figure comes unzoomed; a zoom by hand is told of only after this. The page may have been
    // left by then, and with it the plot.
    plot.on("plotly_afterplot", () => setTimeout(() => {
      if (!plot._fullLayout) return;
      followZoom(plot);
      drawLines();
    }));
    followZoom(plot);
    drawLines();
  }

  function spanOf(plot) {
    const { xaxis } = plot._fullLayout;
    const [min, max] = xaxis.range.map((end) => fromInside(xaxis.r2l(end)));
    return { min, max };
  }

  function followZoom(plot) {
    const { min, max } = zoom || { min: 0, max: flight().duration_s };
    const shown = spanOf(plot);
    if (plot.isFollowing || Math.abs(shown.min - min) + Math.abs(shown.max - max) < 0.05) return;
    plot.isFollowing = true;
    const range = [min, max].map((at_s) => plot._fullLayout.xaxis.l2r(toInside(at_s)));
    Plotly.relayout(plot, { "xaxis.range": range }).finally(() => {
      plot.isFollowing = false;
    });
  }

  // ---- zoom ---------------------------------------------------------------------------------

  function zoomTo(span) {
    const end_s = flight().duration_s;
    const min = span ? Math.max(0, span.min) : 0;
    const max = span ? Math.min(end_s, Math.max(span.max, min + LEAST_SPAN_S)) : end_s;
    zoom = max - min < end_s - 0.5 ? { min, max } : null;
    tiles().showZoom(zoom);
    // Drawing a Plotly chart anew takes 40 ms: not at every step on the way.
    clearTimeout(following);
    following = setTimeout(() => CHARTS.map(plotOf).forEach((plot) => plot && followZoom(plot)), FOLLOW_MS);
    drawLines();
    showZoomOut();
  }

  function showZoomOut() {
    const button = element("zoom-out");
    if (!button) return;
    button.hidden = zoom === null;
    button.textContent = zoom ? `${clock(zoom.min)} to ${clock(zoom.max)}  ✕` : "";
  }

  function panTo(min) {
    if (!zoom) return;
    const width = zoom.max - zoom.min;
    const from = Math.min(Math.max(0, min), flight().duration_s - width);
    zoomTo({ min: from, max: from + width });
  }

  // Around the cursor, or around the middle of what is shown.
  function zoomBy(factor) {
    const { min, max } = zoom || { min: 0, max: flight().duration_s };
    const around = time_s !== null && time_s >= min && time_s <= max ? time_s : (min + max) / 2;
    zoomTo({ min: around - (around - min) * factor, max: around + (max - around) * factor });
  }

  // ---- A and B ------------------------------------------------------------------------------

  const here = () => time_s ?? flight().flownUntil();

  function setBetween(to_a, to_b) {
    [a_s, b_s] = [to_a, to_b];
    tiles().showBetween(a_s, b_s);
    drawLines();
    document.dispatchEvent(new CustomEvent("betweenchanged", { detail: { a_s, b_s } }));
    const shown = element("between");
    if (!shown) return;
    const parts = [a_s === null ? "" : `A ${clock(a_s)}`, b_s === null ? "" : `B ${clock(b_s)}`];
    if (a_s !== null && b_s !== null) parts.push(`${clock(Math.abs(b_s - a_s))} apart`);
    shown.textContent = parts.filter(Boolean).join("  ");
    element("between-clear").hidden = a_s === null && b_s === null;
  }

  // ---- marks --------------------------------------------------------------------------------

  // What is told of a run may come before its flight.
  function showMarks(...messages) {
    if (messages.length) told = messages.filter(Boolean);
    const { onset_s, run } = flight();
    marks = onset_s === null ? [] : [{ kind: "onset", time_s: onset_s, label: "Onset" }];
    for (const message of told) if (message.run === run) marks.push(...message.marks);
    marks.sort((one, other) => one.time_s - other.time_s);
    tiles().showMarks(marks);
    drawLines();
    listMarks();
  }

  // Each mark once, as a button that goes there; of several excesses of one limit the first.
  function listMarks() {
    const list = element("moments");
    if (!list) return;
    const listed = new Set();
    const buttons = [];
    for (const mark of marks) {
      if (listed.has(mark.label)) continue;
      listed.add(mark.label);
      const button = document.createElement("button");
      button.type = "button";
      button.className = `moment-button ${mark.kind}-mark`;
      button.dataset.timeS = mark.time_s;
      const key = document.createElement("i");
      button.append(key, `${mark.label} `, Object.assign(document.createElement("b"), { textContent: clock(mark.time_s) }));
      buttons.push(button);
    }
    list.replaceChildren(...buttons);
  }

  // ---- playing ------------------------------------------------------------------------------

  function play() {
    const end_s = flight().flownUntil();
    if (!(end_s > 0)) return;
    let from_s = time_s === null || time_s >= end_s ? 0 : time_s;
    let before = performance.now();
    const step = (now) => {
      if (!element("scrub")) {
        stop(); // the page has been left
        return;
      }
      from_s += ((now - before) / 1000) * speed;
      before = now;
      if (from_s >= end_s) {
        move(end_s);
        stop();
        return;
      }
      move(from_s);
      playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
    showPlaying();
  }

  function stop() {
    cancelAnimationFrame(playing);
    playing = null;
    showPlaying();
  }

  function showPlaying() {
    const button = element("play");
    if (!button) return;
    button.textContent = playing === null ? "▶" : "❚❚";
    button.setAttribute("aria-label", playing === null ? "Play the flight" : "Pause");
  }

  // ---- hands --------------------------------------------------------------------------------

  const BUTTONS = {
    play: () => (playing === null ? play : stop)(),
    "set-a": () => setBetween(here(), b_s),
    "set-b": () => setBetween(a_s, here()),
    "between-clear": () => setBetween(null, null),
    "zoom-out": () => zoomTo(null),
  };

  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (BUTTONS[button.id]) BUTTONS[button.id]();
    if (button.matches(".moment-button")) move(Number(button.dataset.timeS));
    if (button.matches("#run, #again, #retry") && playing !== null) stop();
  });

  const TYPING = "input:not([type='radio'], [type='checkbox']), textarea, select, [role='dialog']";

  const KEYS = {
    a: BUTTONS["set-a"],
    b: BUTTONS["set-b"],
    "+": () => zoomBy(ZOOM_STEP),
    "=": () => zoomBy(ZOOM_STEP),
    "-": () => zoomBy(1 / ZOOM_STEP),
    0: () => zoomTo(null),
    "<": () => zoom && panTo(zoom.min - PAN_STEP * (zoom.max - zoom.min)),
    ">": () => zoom && panTo(zoom.min + PAN_STEP * (zoom.max - zoom.min)),
    Escape: () => (a_s === null && b_s === null ? move(null) : setBetween(null, null)),
  };

  document.addEventListener("keydown", (event) => {
    if (!element("scrub") || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest(TYPING)) return;
    if (KEYS[event.key]) KEYS[event.key]();
  });

  // ---- called by the rest -------------------------------------------------------------------

  // Another flight: nothing of the last one is left. The Plotly charts get theirs from the server.
  function begin() {
    zoom = null;
    tiles().showZoom(null);
    showZoomOut();
    setBetween(null, null);
    move(null);
    showMarks();
  }

  // The charts come after the page, and the page may be laid out anew.
  document.addEventListener("flightchanged", () => {
    if (time_s === null) showSlider();
    // The onset of a live flight comes when it comes.
    const marked = marks.find(({ kind }) => kind === "onset");
    if ((marked ? marked.time_s : null) !== flight().onset_s) showMarks();
    listenToCharts();
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    cursor: {
      move, point, zoomTo, panTo, begin, showMarks,
      get time_s() { return time_s; },
      // The slider also reports the values that we set: only a hand on it moves the cursor. Nor is it
      // set to where the hand has put it: that could come after the hand's next move, and undo it.
      scrub(value) {
        if (value === slid) return;
        slid = value;
        const root = element("scrub");
        const handled = root && (root.matches(":hover") || root.contains(document.activeElement));
        if (handled && time_s !== value && playing === null) move(value);
      },
      setSpeed(value) {
        speed = Number(value);
      },
    },
  });
})();
