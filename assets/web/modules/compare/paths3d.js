// The flight paths in space, on the page Compare: the colours of the theme, which Plotly's WebGL
// scenes do not take from CSS, and keys to turn and zoom them by.

import { onKeys } from "../kit/keys.js";
import { byId } from "../kit/page.js";
import { colour, schemeChanged } from "../kit/theme.js";

const TURN = Math.PI / 24;
const NEARER = 0.85;
const STEEPEST = 1.45; // radians above the horizon
const BROAD = 1.9;
const WAIT_MS = 100;
const TRIES = 100;

/** @typedef {{ distance: number, round: number, up: number }} View where the camera is */

/** Plots whose camera has been set to their frame. @type {WeakSet<Element>} */
const framed = new WeakSet();

const plot = () => /** @type {any} */ (document.querySelector("#compare-space .js-plotly-plot"));

// The plot is drawn some time after its component came.
function dressWhenDrawn(tries = TRIES) {
  const space = plot();
  if (!byId("compare-space") || !tries) return;
  if (!space?._fullLayout?.scene) {
    setTimeout(() => dressWhenDrawn(tries - 1), WAIT_MS);
    return;
  }
  const ink = colour("--ink-2");
  const grid = colour("--line-strong");
  /** @type {Record<string, string | number>} */
  const change = { "hoverlabel.bgcolor": colour("--surface"), "hoverlabel.bordercolor": grid };
  for (const axis of ["xaxis", "yaxis", "zaxis"]) {
    change[`scene.${axis}.color`] = ink;
    change[`scene.${axis}.gridcolor`] = grid;
  }
  // What fills a broad frame would stick out of a narrow one.
  const shape = space.clientWidth / space.clientHeight;
  if (!framed.has(space) && shape < BROAD) {
    const { eye } = space._fullLayout.scene.camera;
    for (const name of "xyz") change[`scene.camera.eye.${name}`] = (eye[name] * BROAD) / shape;
  }
  framed.add(space);
  window.Plotly.relayout(space, change);
}

/** @param {(view: View) => void} change */
const moveCamera = (change) => () => {
  const space = plot();
  if (!space?._fullLayout.scene) return;
  const camera = space._fullLayout.scene._scene.getCamera();
  const { x, y, z } = camera.eye;
  const view = {
    distance: Math.hypot(x, y, z),
    round: Math.atan2(y, x),
    up: Math.atan2(z, Math.hypot(x, y)),
  };
  change(view);
  const level = view.distance * Math.cos(view.up);
  const eye = {
    x: level * Math.cos(view.round),
    y: level * Math.sin(view.round),
    z: view.distance * Math.sin(view.up),
  };
  window.Plotly.relayout(space, { "scene.camera.eye": eye });
};

/** @param {number} by */
const raise = (by) =>
  moveCamera((view) => {
    view.up = Math.min(STEEPEST, Math.max(-STEEPEST, view.up + by));
  });

/** @param {number} by */
const turn = (by) =>
  moveCamera((view) => {
    view.round += by;
  });

/** @param {number} by */
const zoom = (by) =>
  moveCamera((view) => {
    view.distance = Math.min(4, Math.max(0.3, view.distance * by));
  });

/** Called when the figures are about to be put on the page. */
export function dress() {
  setTimeout(dressWhenDrawn);
}

export function start() {
  schemeChanged.listen(() => dressWhenDrawn(1));
  onKeys({
    within: ".space",
    keys: {
      ArrowLeft: turn(-TURN),
      ArrowRight: turn(TURN),
      ArrowUp: raise(TURN),
      ArrowDown: raise(-TURN),
      "+": zoom(NEARER),
      "=": zoom(NEARER),
      "-": zoom(1 / NEARER),
    },
  });
}
