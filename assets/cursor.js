// The time cursor: one moment of the flight, shown by all charts, readouts and 3D views at once. It
// is moved by pointing at a chart, by the slider under the flight path, by its keys, or by playing.
//
// `tiles.js` announces where its cursor is; the server moves the aircraft of the live view.

(function () {
  "use strict";

  const ANNOUNCE_MS = 100;
  // Plotly's date axes count from a day on: see `moment` in `app/panels/axes.py`.
  const DAY_S = 86400;
  const CHARTS = ["probabilities", "residual-strip"];

  let time_s = null; // null: nothing pointed at, the views show the latest
  let playing = null;
  let speed = 10;
  let announced = null;

  const tiles = () => window.dash_clientside.tiles;
  const setProps = (id, props) => window.dash_clientside.set_props(id, props);

  // ---- following ----------------------------------------------------------------------------

  function move(to_s, from) {
    time_s = to_s;
    if (from !== "tiles") tiles().moveCursor(to_s);
    drawLines();
    if (announced === null) announced = setTimeout(announce, ANNOUNCE_MS);
  }

  // The costly ones: the slider is drawn by React, the aircraft are moved by the server.
  function announce() {
    announced = null;
    setProps("cursor", { data: time_s });
    if (time_s !== null) setProps("scrub", { value: time_s });
    const replay = document.querySelector("#scene iframe[sandbox]");
    if (replay && time_s !== null) {
      replay.contentWindow.postMessage({ type: "seek", time_s }, "*");
    }
  }

  function drawLines() {
    for (const id of CHARTS) {
      const plot = document.querySelector(`#${id} .js-plotly-plot`);
      const axis = plot && plot._fullLayout && plot._fullLayout.xaxis;
      if (!axis) continue;
      let line = plot.querySelector(".cursor-line");
      if (!line) {
        line = document.createElement("div");
        line.className = "cursor-line";
        plot.append(line);
      }
      const at = time_s === null ? NaN : axis.d2p((time_s + DAY_S) * 1000);
      line.hidden = !(at >= 0 && at <= axis._length);
      if (line.hidden) continue;
      const { t, h } = plot._fullLayout._size;
      Object.assign(line.style, {
        left: `${axis._offset + at}px`, top: `${t}px`, height: `${h}px`,
      });
    }
  }

  document.addEventListener("tilescursor", (event) => move(event.detail, "tiles"));

  // ---- playing ------------------------------------------------------------------------------

  function play() {
    const end_s = tiles().flownUntil();
    if (!(end_s > 0)) return;
    let from_s = time_s === null || time_s >= end_s ? 0 : time_s;
    let before = performance.now();
    const step = (now) => {
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
    const button = document.getElementById("play");
    if (!button) return;
    button.textContent = playing === null ? "▶" : "❚❚";
    button.setAttribute("aria-label", playing === null ? "Play the flight" : "Pause");
  }

  document.addEventListener("click", (event) => {
    if (event.target.closest("#play")) (playing === null ? play : stop)();
    if (event.target.closest("#run, #again, #retry") && playing !== null) stop();
  });

  // ---- called by Dash -----------------------------------------------------------------------

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    cursor: {
      // The slider also reports the values that we set: only a hand on it moves the cursor.
      scrub(value) {
        const root = document.getElementById("scrub");
        const handled = root && (root.matches(":hover") || root.contains(document.activeElement));
        if (handled && time_s !== value && playing === null) move(value, "scrub");
      },
      point(hover) {
        const x = hover && hover.points && hover.points[0] && hover.points[0].x;
        if (typeof x !== "string" || playing !== null) return;
        move(Date.parse(`${x.replace(" ", "T")}Z`) / 1000 - DAY_S);
      },
      setSpeed(value) {
        speed = Number(value);
      },
      label(value) {
        return tiles() ? tiles().clock(value || 0) : "";
      },
    },
  });
})();
