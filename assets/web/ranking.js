// The classifier's answer at the time cursor. Without a cursor the page shows its verdict instead,
// which the server writes. The answers of all windows come from `track` in `app/figures/marks.py`.

(function () {
  "use strict";

  const LEADERS = 5;

  let track = null;

  const flight = () => window.dash_clientside.flight;

  // The newest window that had ended by then.
  function windowAt(time_s) {
    let found = -1;
    track.time_s.forEach((end_s, place) => {
      if (end_s <= time_s) found = place;
    });
    return found;
  }

  function row() {
    const item = document.createElement("li");
    item.innerHTML =
      '<span class="rank-name"></span><span class="rank-bar"><span class="rank-fill"></span></span>' +
      '<span class="rank-share mono"></span>';
    return item;
  }

  function listIn(place) {
    if (!place.firstChild) {
      const list = document.createElement("ol");
      list.className = "ranking";
      list.append(...Array.from({ length: LEADERS }, row));
      place.append(Object.assign(document.createElement("p"), { className: "note" }), list);
    }
    return place.lastChild;
  }

  function fill(list, leaders) {
    [...list.children].forEach((item, rank) => {
      item.hidden = rank >= leaders.length;
      if (item.hidden) return;
      const [place, share] = leaders[rank];
      const { name, colour } = track.classes[place];
      const [label, bar, value] = item.children;
      label.textContent = name;
      bar.firstChild.style.width = `${(100 * share).toFixed(1)}%`;
      bar.firstChild.style.backgroundColor = colour || "var(--mirror)";
      value.textContent = `${(100 * share).toFixed(1)} %`;
    });
  }

  function show() {
    const place = document.getElementById("ranking-at");
    if (!place) return;
    const { time_s } = window.dash_clientside.cursor;
    const follows = time_s !== null && track !== null && track.run === flight().run && track.time_s.length > 0;
    place.hidden = !follows;
    document.getElementById("ranking").hidden = follows;
    if (!follows) return;
    const list = listIn(place);
    const found = windowAt(time_s);
    const at = flight().clock(time_s);
    place.firstChild.textContent = found < 0
      ? `No answer yet at ${at}: the first window ends at ${flight().clock(track.time_s[0])}.`
      : `Answer at ${at}, to the 30 s up to ${flight().clock(track.time_s[found])}`;
    list.hidden = found < 0;
    if (found >= 0) fill(list, track.leaders[found]);
  }

  document.addEventListener("cursormoved", show);

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    ranking: {
      take(message) {
        track = message || null;
        show();
      },
    },
  });
})();
