// Finer samples of the part of a flight that is zoomed into: what the page holds of the whole is
// thinned for the width of a screen. `app/pages/fly/detail.py` answers; a request is as heavy as the whole view
// at most, however long the part. Only the newest zoom is asked about, and once it rests.

(function () {
  "use strict";

  const REST_MS = 120;
  const GROWING_MS = 1000;
  const MARGIN = 0.25; // to either side, as a share of what is shown: panning begins with what is there
  const LOOSE = 2; // held samples do for a zoom that is narrower by this factor at most

  let zoom = null;
  let held = null; // the part that is drawn finer
  let asking = null; // aborts the request that is under way
  let due = null;

  const flight = () => window.dash_clientside.flight;

  function cancel() {
    clearTimeout(due);
    if (asking) asking.abort();
    due = asking = null;
  }

  function isHeld() {
    if (!held || held.key !== flight().key || held.isWhole !== isWhole()) return false;
    const isAsFine = held.is_exact || held.max - held.min <= LOOSE * (zoom.max - zoom.min);
    const hasGrown = Math.min(flight().flownUntil(), zoom.max) > held.until_s + 0.5;
    return isAsFine && !hasGrown && held.min <= zoom.min && zoom.max <= held.max;
  }

  const isWhole = () => flight().count === Number.MAX_SAFE_INTEGER;

  async function ask() {
    due = null;
    const { key, run, duration_s } = flight();
    if (!run) return;
    const margin = MARGIN * (zoom.max - zoom.min);
    const min = Math.max(0, zoom.min - margin);
    const max = Math.min(duration_s, zoom.max + margin);
    const part = { key, min, max, isWhole: isWhole() };
    const own = (asking = new AbortController());
    try {
      const address = `/runs/${run}/detail?from_s=${min.toFixed(3)}&to_s=${max.toFixed(3)}`;
      const answer = await fetch(address, { signal: own.signal });
      const { whole, ...said } = answer.ok ? await answer.json() : {};
      if (whole && flight().key === key) show({ ...part, ...said }, whole);
    } catch (error) {
      if (error.name !== "AbortError") console.warn("No finer samples:", error.message);
    } finally {
      if (asking === own) asking = null;
    }
  }

  function show(part, whole) {
    held = part;
    flight().refine(whole);
    window.dash_clientside.tiles.refresh();
    document.dispatchEvent(new CustomEvent("flightrefined"));
  }

  document.addEventListener("zoomchanged", ({ detail }) => {
    zoom = detail;
    cancel();
    if (zoom && !isHeld()) due = setTimeout(ask, REST_MS);
    if (zoom || !held) return;
    held = null;
    flight().refine(null);
    window.dash_clientside.tiles.refresh();
  });

  // The flight goes on, or has become whole, while a part of it is looked at.
  document.addEventListener("flightchanged", () => {
    if (zoom && !due && !asking && !isHeld()) due = setTimeout(ask, GROWING_MS);
  });
})();
