// The flight paths in space, on the page Compare: the colours of the theme, which Plotly's WebGL
// scenes do not take from CSS, and keys to turn and zoom them by.

(function () {
  "use strict";

  const TURN = Math.PI / 24;
  const NEARER = 0.85;
  const STEEPEST = 1.45; // radians above the horizon
  const BROAD = 1.9;
  const WAIT_MS = 100;
  const TRIES = 100;

  const plot = () => document.querySelector("#compare-space .js-plotly-plot");

  // The plot is drawn some time after its component came.
  function dress(tries = TRIES) {
    const space = plot();
    if (!document.getElementById("compare-space") || !tries) return;
    if (!space || !space._fullLayout || !space._fullLayout.scene) {
      setTimeout(() => dress(tries - 1), WAIT_MS);
      return;
    }
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue("--ink-2").trim();
    const grid = style.getPropertyValue("--line-strong").trim();
    const change = { "hoverlabel.bgcolor": style.getPropertyValue("--surface").trim(), "hoverlabel.bordercolor": grid };
    for (const axis of ["xaxis", "yaxis", "zaxis"]) {
      change[`scene.${axis}.color`] = ink;
      change[`scene.${axis}.gridcolor`] = grid;
    }
    // What fills a broad frame would stick out of a narrow one.
    const shape = space.clientWidth / space.clientHeight;
    if (!space.isFramed && shape < BROAD) {
      const { eye } = space._fullLayout.scene.camera;
      for (const name of "xyz") change[`scene.camera.eye.${name}`] = (eye[name] * BROAD) / shape;
    }
    space.isFramed = true;
    Plotly.relayout(space, change);
  }

  function moveCamera(change) {
    const space = plot();
    if (!space || !space._fullLayout.scene) return;
    const camera = space._fullLayout.scene._scene.getCamera();
    const { x, y, z } = camera.eye;
    const at = {
      distance: Math.hypot(x, y, z),
      round: Math.atan2(y, x),
      up: Math.atan2(z, Math.hypot(x, y)),
    };
    change(at);
    const level = at.distance * Math.cos(at.up);
    const eye = {
      x: level * Math.cos(at.round),
      y: level * Math.sin(at.round),
      z: at.distance * Math.sin(at.up),
    };
    Plotly.relayout(space, { "scene.camera.eye": eye });
  }

  const raise = (by) => (at) => {
    at.up = Math.min(STEEPEST, Math.max(-STEEPEST, at.up + by));
  };
  const turn = (by) => (at) => { at.round += by; };
  const zoom = (by) => (at) => { at.distance = Math.min(4, Math.max(0.3, at.distance * by)); };

  const KEYS = {
    ArrowLeft: turn(-TURN),
    ArrowRight: turn(TURN),
    ArrowUp: raise(TURN),
    ArrowDown: raise(-TURN),
    "+": zoom(NEARER),
    "=": zoom(NEARER),
    "-": zoom(1 / NEARER),
  };

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    if (!event.target.matches(".space")) return;
    event.preventDefault();
    moveCamera(KEYS[event.key]);
  });

  new MutationObserver(() => dress(1)).observe(document.documentElement, {
    attributes: true,
    attributeFilter: ["data-mantine-color-scheme"],
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    paths3d: {
      dress: () => {
        setTimeout(dress); // the figures are not on the page yet
      },
    },
  });
})();
