// Sentences of the report that cite something: a click, Enter or Space moves the time cursor to
// where it shows and lights the channels. Arrow keys go from sentence to sentence; Escape puts the
// lights out. What a sentence cites is in its data attributes, which `app/pages/report/text.py`
// sets.

(function () {
  "use strict";

  const CITING = '.claim[role="button"]';

  function lightsOut() {
    document.querySelectorAll(".tile.cited").forEach((tile) => tile.classList.remove("cited"));
    document.querySelectorAll(".claim[aria-pressed]").forEach((claim) => claim.removeAttribute("aria-pressed"));
  }

  function show(claim) {
    const wasLit = claim.getAttribute("aria-pressed") === "true";
    lightsOut();
    if (wasLit) return;
    claim.setAttribute("aria-pressed", "true");
    const charts = claim.dataset.tiles
      .split(" ")
      .map((index) => document.getElementById(`tile-${index}`))
      .filter(Boolean);
    charts.forEach((chart) => chart.closest(".tile").classList.add("cited"));
    if (charts.length) charts[0].closest(".tile").scrollIntoView({ block: "nearest" });
    if (claim.dataset.startS) window.dash_clientside.cursor.move(Number(claim.dataset.startS));
  }

  function step(claim, by) {
    const all = [...claim.closest(".report").querySelectorAll(CITING)];
    const next = all[all.indexOf(claim) + by];
    if (!next) return;
    claim.tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  }

  document.addEventListener("click", (event) => {
    if (event.target.closest("#run, #again, #retry")) lightsOut();
    const claim = event.target.closest(CITING);
    if (claim && getSelection().isCollapsed) show(claim);
  });

  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") lightsOut();
    const claim = event.target.closest(CITING);
    if (!claim || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Enter" || event.key === " ") show(claim);
    else if (event.key === "ArrowDown") step(claim, 1);
    else if (event.key === "ArrowUp") step(claim, -1);
    else return;
    event.preventDefault();
  });
})();
