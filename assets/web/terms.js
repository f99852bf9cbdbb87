// Words that explain themselves, `term` in `app/kit/terms.py`: what they mean shows beside them while
// the pointer rests on them or they have the focus. Escape, or going elsewhere, takes it away.

(function () {
  "use strict";

  const DELAY_MS = 200;
  const GAP_PX = 6;
  const ID = "meaning";

  let shownFor = null;
  let waiting = null;

  function show(word) {
    hide();
    shownFor = word;
    const box = Object.assign(document.createElement("div"), { id: ID, className: ID });
    box.setAttribute("role", "tooltip");
    box.textContent = word.dataset.meaning;
    document.body.append(box);
    word.setAttribute("aria-describedby", ID);
    place(word.getBoundingClientRect(), box);
  }

  // Over the word, under it where there is no room; within the window.
  function place(word, box) {
    const { width, height } = box.getBoundingClientRect();
    const middle = (word.left + word.right - width) / 2;
    const over = word.top - height - GAP_PX;
    box.style.left = `${Math.max(4, Math.min(middle, document.documentElement.clientWidth - width - 4))}px`;
    box.style.top = `${over >= 4 ? over : word.bottom + GAP_PX}px`;
  }

  function hide() {
    clearTimeout(waiting);
    if (shownFor) shownFor.removeAttribute("aria-describedby");
    document.getElementById(ID)?.remove();
    shownFor = null;
  }

  const wordOf = (event) => event.target.closest?.(".term[data-meaning]");

  document.addEventListener("pointerover", (event) => {
    const word = wordOf(event);
    if (word && word === shownFor) return;
    // What it says can itself be pointed at, to be read at leisure.
    if (event.target.id === ID) return;
    if (shownFor && document.activeElement !== shownFor) hide();
    clearTimeout(waiting);
    if (word) waiting = setTimeout(show, DELAY_MS, word);
  });
  document.addEventListener("focusin", (event) => {
    const word = wordOf(event);
    if (word) show(word);
  });
  document.addEventListener("focusout", (event) => wordOf(event) && hide());
  document.addEventListener("scroll", () => shownFor && hide(), { capture: true, passive: true });
  document.addEventListener("keydown", (event) => event.key === "Escape" && hide(), true);
})();
