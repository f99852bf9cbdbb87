// The presenter view: an address beginning with /present/ puts Fly on the wall. Keys do the rest:
// P goes there and back, Space plays, arrows move the time cursor, F fills the screen, H hides what
// a class is to find, Escape leaves.

(function () {
  "use strict";

  const PREFIX = "/present/";
  const STEP_S = 5;
  const root = document.documentElement;

  let before = null; // the theme that comes back afterwards

  const setProps = (id, props) => window.dash_clientside.mirrortwin.setProps(id, props);
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
    const { cursor, flight } = window.dash_clientside;
    const end_s = flight.flownUntil();
    cursor.move(Math.min(Math.max((cursor.time_s ?? end_s) + by_s, 0), end_s));
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
    } else if (event.key.toLowerCase() === "h") document.getElementById("wall-hide")?.click();
    else if (event.key === " ") document.getElementById("play")?.click();
    else if (event.key === "ArrowRight") move(STEP_S);
    else if (event.key === "ArrowLeft") move(-STEP_S);
    else return;
    event.preventDefault();
  });

  document.addEventListener("click", (event) => {
    // Space is for playing now: pressed once more on the box it would show what is hidden.
    if (presenting() && event.target.id === "wall-hide" && event.detail > 0) event.target.blur();
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
