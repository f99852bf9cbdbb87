// Parts of the page that are drawn from plain data, [tag, attributes, children] as made by
// `app/kit/nodes.py`, and not by React, which would hold the page up for each of their hundreds of
// elements. A part that comes again unchanged is left as it stands, with its focus.
//
// What a run is called and what a language model writes becomes text, never HTML.

/** @typedef {string | [string, Record<string, any>, any[]]} Part */

const TAGS = new Set(
  "a code dd del details div dl dt em h2 li ol p span strong summary table tbody td th thead tr ul".split(
    " ",
  ),
);

/** What was last drawn into an element, as JSON. @type {WeakMap<Element, string[]>} */
const drawn = new WeakMap();

/**
 * @param {Part} part
 * @returns {Node}
 */
function node(part) {
  if (typeof part === "string") return document.createTextNode(part);
  const [tag, attributes, children] = part;
  if (!TAGS.has(tag)) throw new Error(`no ${tag} is drawn here`);
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "style") Object.assign(element.style, value);
    else if (name.startsWith("on") || (name === "href" && !/^\/(?!\/)/.test(value))) continue;
    else element.setAttribute(name, value);
  }
  element.append(...children.map(node));
  return element;
}

/**
 * What draws parts into an element of the page and returns how many there are.
 * @param {string} id
 */
export function into(id) {
  return (/** @type {Part[]} */ parts) => {
    const root = document.getElementById(id);
    if (!root) return 0;
    const texts = parts.map((part) => JSON.stringify(part));
    const before = drawn.get(root) ?? [];
    parts.forEach((part, place) => {
      if (texts[place] === before[place]) return;
      if (place < root.childNodes.length) root.childNodes[place].replaceWith(node(part));
      else root.append(node(part));
    });
    while (root.lastChild && root.childNodes.length > parts.length) root.lastChild.remove();
    drawn.set(root, texts);
    return parts.length;
  };
}
