// Where a small box goes that belongs to something on the page.

const MARGIN_PX = 4;

/**
 * @typedef {{ left: number, top: number, right: number, bottom: number }} Box
 * @typedef {{ width: number, height: number }} Size
 * @typedef {"right" | "left" | "below" | "above" | "over" | "under"} Side
 */

/**
 * As near to `value` as lets `size` end before `end`.
 * @param {number} value
 * @param {number} size
 * @param {number} end
 */
const within = (value, size, end) => Math.max(MARGIN_PX, Math.min(value, end - size - MARGIN_PX));

/**
 * The left upper corner of a box beside another, inside the window: on the first of the sides that has
 * room, else on the last. To the right and to the left it begins where the other begins, as it does
 * below and above; over and under it stands in the middle.
 * @param {Box} anchor
 * @param {Size} size
 * @param {Size} view
 * @param {Side[]} sides
 * @param {number} gap
 * @returns {[number, number]}
 */
export function placed(anchor, { width, height }, view, sides, gap) {
  const middle = (anchor.left + anchor.right - width) / 2;
  /** @type {Record<Side, [number, number]>} */
  const corners = {
    right: [anchor.right + gap, anchor.top],
    left: [anchor.left - width - gap, anchor.top],
    below: [anchor.left, anchor.bottom + gap],
    above: [anchor.left, anchor.top - height - gap],
    over: [middle, anchor.top - height - gap],
    under: [middle, anchor.bottom + gap],
  };
  const hasRoom = (/** @type {Side} */ side) => {
    const [x, y] = corners[side];
    if (side === "right") return x + width <= view.width - MARGIN_PX;
    if (side === "left") return x >= MARGIN_PX;
    if (side === "below" || side === "under") return y + height <= view.height - MARGIN_PX;
    return y >= MARGIN_PX;
  };
  const side = sides.find(hasRoom);
  if (side === undefined) {
    // Over the lower right corner of what is too large to stand beside.
    const right = Math.min(anchor.right, view.width) - width - 16;
    const bottom = Math.min(anchor.bottom, view.height) - height - 16;
    return [within(right, width, view.width), within(bottom, height, view.height)];
  }
  const [x, y] = corners[side];
  return [within(x, width, view.width), within(y, height, view.height)];
}

/**
 * Puts a box that is on the page beside something, or beside a point.
 * @param {HTMLElement} box
 * @param {Box} anchor
 * @param {Side[]} sides
 * @param {number} gap
 */
export function place(box, anchor, sides, gap) {
  const { clientWidth, clientHeight } = document.documentElement;
  const view = { width: clientWidth, height: clientHeight };
  const [left, top] = placed(anchor, box.getBoundingClientRect(), view, sides, gap);
  box.style.left = `${left}px`;
  box.style.top = `${top}px`;
}
