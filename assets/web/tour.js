// The tour of Fly: a card beside one part of the page after the other. It takes nothing away: the page
// stays usable under it. Whether it has been taken or declined is remembered in this browser.

(function () {
  "use strict";

  const REMEMBERED = "mirrortwin-tour";
  const GAP_PX = 10;
  const PATIENCE_MS = 15000;

  let stops = [];
  let at = 0;
  let card = null;
  let cameFrom = null;

  const invitation = () => document.getElementById("tour-invitation");
  const onFly = () => document.getElementById("fly") !== null;

  function remembered() {
    try {
      return localStorage.getItem(REMEMBERED);
    } catch {
      return "unknown"; // no storage here: nothing could be remembered, so do not ask
    }
  }

  function remember(what) {
    try {
      localStorage.setItem(REMEMBERED, what);
    } catch { /* then it is asked again */ }
    const line = invitation();
    if (line) line.hidden = true;
  }

  // ---- the card -----------------------------------------------------------------------------

  const visible = (element) => element && element.getClientRects().length > 0;

  async function start() {
    cameFrom = document.activeElement;
    remember("seen");
    if (!onFly()) window.dash_clientside.mirrortwin.setProps("url", { pathname: "/" });
    const until = performance.now() + PATIENCE_MS;
    while (!document.querySelector(".tile canvas")) {
      if (performance.now() > until) return;
      await new Promise((later) => setTimeout(later, 100));
    }
    stops = JSON.parse(invitation().dataset.stops)
      .filter((stop) => visible(document.querySelector(stop.target)));
    at = 0;
    show();
  }

  function element(tag, text, set = {}) {
    return Object.assign(document.createElement(tag), { textContent: text, ...set });
  }

  function show() {
    clear();
    const stop = stops[at];
    const target = document.querySelector(stop.target);
    if (!target) return end();
    target.classList.add("tour-target");
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const tall = target.getBoundingClientRect().height > 0.7 * innerHeight;
    target.scrollIntoView({ block: tall ? "start" : "nearest", behavior: calm ? "auto" : "smooth" });

    card = element("div", "", { className: "tour-card panel" });
    card.setAttribute("role", "dialog");
    card.setAttribute("aria-labelledby", "tour-title");
    card.setAttribute("aria-describedby", "tour-text");
    const last = at === stops.length - 1;
    const buttons = element("div", "", { className: "tour-buttons" });
    buttons.append(element("span", `${at + 1} of ${stops.length}`, { className: "note" }));
    if (!last) buttons.append(element("button", "Skip", { type: "button", onclick: end }));
    if (at > 0) buttons.append(element("button", "Back", { type: "button", onclick: () => step(-1) }));
    const next = element("button", last ? "Done" : "Next", {
      type: "button", className: "tour-next", onclick: () => step(1),
    });
    buttons.append(next);
    card.append(
      element("h2", stop.title, { id: "tour-title" }), element("p", stop.text, { id: "tour-text" }),
      buttons,
    );
    document.body.append(card);
    place();
    next.focus({ preventScroll: true });
  }

  // Beside its target, on whichever side has room; else over its lower right corner.
  function place() {
    if (!card) return;
    const target = document.querySelector(stops[at].target);
    if (!target) return;
    const box = target.getBoundingClientRect();
    const { width, height } = card.getBoundingClientRect();
    const fits = (x, y) =>
      x >= 4 && y >= 4 && x + width <= innerWidth - 4 && y + height <= innerHeight - 4;
    const top = Math.min(Math.max(box.top, 56), innerHeight - height - 8);
    const left = Math.min(Math.max(box.left, 8), innerWidth - width - 8);
    const places = [
      [box.right + GAP_PX, top], [box.left - width - GAP_PX, top],
      [left, box.bottom + GAP_PX], [left, box.top - height - GAP_PX],
      [Math.min(box.right, innerWidth) - width - 16, Math.min(box.bottom, innerHeight) - height - 16],
    ];
    const [x, y] = places.find(([px, py]) => fits(px, py)) || [8, innerHeight - height - 8];
    Object.assign(card.style, { left: `${Math.max(4, x)}px`, top: `${Math.max(4, y)}px` });
  }

  function step(by) {
    at += by;
    if (at >= stops.length || at < 0) end();
    else show();
  }

  function clear() {
    document.querySelector(".tour-target")?.classList.remove("tour-target");
    if (card) card.remove();
    card = null;
  }

  function end() {
    clear();
    if (cameFrom && cameFrom.isConnected) cameFrom.focus();
  }

  // ---- listening ----------------------------------------------------------------------------

  addEventListener("scroll", place, { passive: true });
  addEventListener("resize", place);

  document.addEventListener("keydown", (event) => {
    if (!card || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") end();
    else if (!card.contains(event.target)) return;
    else if (event.key === "ArrowRight") step(1);
    else if (event.key === "ArrowLeft" && at > 0) step(-1);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }, true);

  document.addEventListener("click", (event) => {
    const asked = event.target.closest("[data-tour]")?.dataset.tour;
    if (asked === "start") start();
    else if (asked === "decline") remember("declined");
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    tour: {
      invite(kind) {
        if (kind !== "fly" && card) end();
        return kind !== "fly" || remembered() !== null;
      },
    },
  });
})();
