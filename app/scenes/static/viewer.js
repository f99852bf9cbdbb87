// Shows one recording in the Rerun viewer, inside a sandboxed iframe.
//
// Address: viewer.html?url=/recordings/RUN.rrd&theme=dark|light
// From the page:  {type: "seek", time_s}  stop at that time;  {type: "follow"}  stay at the end.
// To the page:    {type: "ready"}  the recording is open.

import { WebViewer } from "./widget.js";

// The viewer asks GitHub for its latest release. Nobody here asked it to.
const fetchAnything = globalThis.fetch;
globalThis.fetch = (resource, options) => {
  const url = new URL(resource instanceof Request ? resource.url : resource, location.href);
  return url.origin === new URL(location.href).origin
    ? fetchAnything(resource, options)
    : Promise.resolve(new Response(null, { status: 204 }));
};

const NANOS_PER_S = 1e9;
const TIMELINE = "t";
const NARROW_PX = 560;

export const viewer = new WebViewer();

const notice = document.getElementById("notice");
let wanted = null;
let moving = false;

// Seeks arrive faster than the viewer takes them: the latest one wins.
async function move(target) {
  wanted = target;
  if (moving || !viewer.ready) return;
  moving = true;
  while (wanted !== null) {
    const next = wanted;
    wanted = null;
    try {
      await viewer.set_time({ timeline: TIMELINE, ...next });
    } catch (error) {
      console.debug("The viewer did not move:", error);
    }
  }
  moving = false;
}

function obey(message) {
  if (message?.type === "seek" && Number.isFinite(message.time_s)) {
    const nanos = BigInt(Math.round(message.time_s * NANOS_PER_S));
    move({ duration_nanos: nanos, play_state: "paused" });
  } else if (message?.type === "follow") {
    move({ play_state: "following" });
  }
}

// The address of a recording of this server, or null: this page opens nothing from elsewhere.
function recordingUrl() {
  const here = new URL(location.href);
  const url = new URL(here.searchParams.get("url") ?? "", here);
  const recordings = new URL("../recordings/", here);
  return url.href.startsWith(recordings.href) ? url : null;
}

async function exists(url) {
  const response = await fetch(url, { method: "HEAD" });
  await response.text(); // there is none, but unread it would count as an aborted request
  return response.ok;
}

async function main() {
  const url = recordingUrl();
  if (url === null || !(await exists(url))) {
    notice.textContent = "There is no recording of this run. Run it again to get one.";
    return;
  }
  await viewer.start(null, document.getElementById("viewer"), {
    width: "100%",
    height: "100%",
    theme: document.documentElement.dataset.theme,
    hide_welcome_screen: true,
    render_backend: "webgl",
    notebook: true,
  });
  for (const panel of ["top", "blueprint", "selection"]) {
    viewer.override_panel_state(panel, "hidden");
  }
  viewer.override_panel_state("time", "collapsed");
  viewer.once("recording_open", () => {
    // A recording from an address starts by playing; ours stay at the newest sample.
    move(wanted ?? { play_state: "following" });
    if (innerWidth < NARROW_PX) viewer.open(new URL("narrow.rbl", location.href).href);
    window.parent.postMessage({ type: "ready" }, "*");
  });
  viewer.open(url.href);
}

window.addEventListener("message", (event) => {
  if (event.source === window.parent) obey(event.data);
});

main().catch((error) => {
  console.error(error);
  notice.textContent = "The 3D viewer could not start. It needs WebGL 2.";
});
