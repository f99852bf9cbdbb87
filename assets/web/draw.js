// Parts of the page that are drawn from plain data, [tag, attributes, children] as made by
// `app/kit/nodes.py`, and not by React, which would hold the page up for each of their hundreds of
// elements. A part that comes again unchanged is left as it stands, with its focus.
//
// What a run is called and what a language model writes becomes text, never HTML.

(function () {
  "use strict";

  const TAGS = new Set(
    "a code dd del details div dl dt em h2 li ol p span strong summary table tbody td th thead tr ul".split(" "),
  );

  function element([tag, attributes, children]) {
    if (!TAGS.has(tag)) throw new Error(`no ${tag} is drawn here`);
    const drawn = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name === "style") Object.assign(drawn.style, value);
      else if (name.startsWith("on") || (name === "href" && !/^\/(?!\/)/.test(value))) continue;
      else drawn.setAttribute(name, value);
    }
    drawn.append(...children.map(node));
    return drawn;
  }

  const node = (part) => (typeof part === "string" ? document.createTextNode(part) : element(part));

  // Returns how many parts there are.
  function into(id) {
    return (parts) => {
      const root = document.getElementById(id);
      if (!root) return 0;
      const said = parts.map((part) => JSON.stringify(part));
      const before = root.said || [];
      parts.forEach((part, place) => {
        if (said[place] === before[place]) return;
        const drawn = node(part);
        if (place < root.childNodes.length) root.childNodes[place].replaceWith(drawn);
        else root.append(drawn);
      });
      while (root.childNodes.length > parts.length) root.lastChild.remove();
      root.said = said;
      return parts.length;
    };
  }

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    draw: { report: into("report"), answers: into("answers"), ranking: into("ranking") },
  });
})();
