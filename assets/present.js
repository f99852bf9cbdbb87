// The presenter view: an address beginning with /present/ puts Fly on the wall. Keys do the rest:
// P goes there and back, Space plays, arrows move the time cursor, F fills the screen, Escape leaves.

(function () {
  "use strict";

  const PREFIX = "/present/";
  const STEP_S = 5;
  const FRESH_MS = 400;
  const root = document.documentElement;

  let moved_s = 0;
  let movedAt_ms = -Infinity;
  let before = null; // the theme that comes back afterwards

  const setProps = (id, props) => window.dash_clientside.set_props(id, props);
  const presenting = () => "presenting" in root.dataset;
  const onFly = () => document.getElementById("fly") !== null;

  function put(on) {
    if (on === presenting()) return;
    const scheme = root.getAttribute("data-mantine-color-scheme");
    if (on) {
      before = scheme;
      root.dataset.presenting = "";
      root.setAttribute("data-mantine-color-scheme", "dark");
    } else {
      delete root.dataset.presenting;
      root.setAttribute("data-mantine-color-scheme", before || "light");
      if (document.fullscreenElement) document.exitFullscreen();
    }
    document.getElementById("present")?.setAttribute("aria-pressed", String(on));
    window.dispatchEvent(new Event("resize"));
  }

  // The wall is dark whatever Mantine remembers.
  new MutationObserver(() => {
    if (presenting() && root.getAttribute("data-mantine-color-scheme") !== "dark") {
      root.setAttribute("data-mantine-color-scheme", "dark");
    }
  }).observe(root, { attributes: true, attributeFilter: ["data-mantine-color-scheme"] });

  function toggle() {
    const [, , run] = location.pathname.split("/");
    if (presenting()) {
      if (location.pathname.startsWith(PREFIX)) setProps("url", { pathname: `/run/${run}` });
      put(false);
    } else if (onFly()) {
      if (location.pathname.startsWith("/run/")) setProps("url", { pathname: PREFIX + run });
      put(true);
    }
  }

  function move(by_s) {
    const { tiles } = window.dash_clientside;
    const thumb = document.querySelector("#scrub [role=slider]");
    // The slider follows a moment later: a held key must not wait for it.
    const isFresh = performance.now() - movedAt_ms < FRESH_MS;
    const now_s = isFresh ? moved_s : Number(thumb?.getAttribute("aria-valuenow") || 0);
    const to_s = Math.min(Math.max(now_s + by_s, 0), tiles.flownUntil());
    [moved_s, movedAt_ms] = [to_s, performance.now()];
    tiles.moveCursor(to_s);
    document.dispatchEvent(new CustomEvent("tilescursor", { detail: to_s }));
  }

  const isTyping = (target) =>
    target.closest("input, textarea, select, [contenteditable], [role=slider], [role=radio]");

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (event.key.toLowerCase() === "p" && onFly() && !isTyping(event.target)) toggle();
    else if (!presenting()) return;
    else if (event.key === "Escape") toggle();
    else if (isTyping(event.target)) return;
    else if (event.key.toLowerCase() === "f") {
      if (document.fullscreenElement) document.exitFullscreen();
      else root.requestFullscreen?.();
    } else if (event.key === " ") document.getElementById("play")?.click();
    else if (event.key === "ArrowRight") move(STEP_S);
    else if (event.key === "ArrowLeft") move(-STEP_S);
    else return;
    event.preventDefault();
  });

  document.addEventListener("click", (event) => {
    if (!event.target.closest("#present")) return;
    toggle();
    // Space is for playing now, not for this button.
    document.activeElement?.blur();
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    present: {
      follow(path, channels) {
        if (onFly()) {
          (channels || []).forEach((index, order) => {
            const tile = document.getElementById(`tile-${index}`)?.closest(".tile");
            if (!tile) return;
            tile.classList.add("on-wall");
            tile.style.setProperty("--wall-order", order);
          });
        }
        const wanted = (path || "").startsWith(PREFIX);
        if (wanted || location.pathname !== "/") put(wanted);
        return wanted;
      },
    },
  });
})();
