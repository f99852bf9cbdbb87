// What the buttons of the page Runs apply to: the rows that are selected and pass search and filters,
// as they are now. The grid keeps rows selected that it hides, and hands out as they were when selected.

import { CONSTANTS } from "../kit/page.js";

/** @typedef {{ id: string, status: string }} Row */

/**
 * @param {string | null} text
 * @param {Record<string, unknown>} options
 */
export const search = (text, options) => ({ ...options, quickFilterText: text || "" });

/**
 * The values of all outputs, in the order of `app/pages/runs/callbacks.py`.
 * @param {Row[] | null} selected
 * @param {Row[] | null} seen
 */
export function chosen(selected, seen) {
  const rows = new Map((seen || []).map((row) => [row.id, row]));
  const found = (selected || []).map((row) => rows.get(row.id)).filter((row) => row !== undefined);
  const hidden = (selected || []).length - found.length;
  const ids = found.map((row) => row.id);
  const all = ids.length > 0 && found.every((row) => row.status === "done");
  const one = all && ids.length === 1 ? ids[0] : null;
  const zip = all ? `/runs/files?${ids.map((id) => `id=${id}`).join("&")}` : "#";
  const counted = (/** @type {string} */ word) => (ids.length ? `${word} ${ids.length}` : word);
  return [
    ids,
    hidden ? `${hidden} more selected, hidden by the filter` : "",
    counted("Compare"),
    !(all && ids.length <= CONSTANTS.mostCompared),
    counted("Export"),
    !all,
    counted("Delete"),
    ids.length === 0,
    zip,
    !all,
    one ? `/runs/${one}/faulted.csv` : "#",
    !one,
    one ? `/runs/${one}/mirror.csv` : "#",
    !one,
  ];
}

/**
 * @param {number | null} clicks
 * @param {string[] | null} ids
 */
export function compare(clicks, ids) {
  if (!clicks || !ids?.length) return window.dash_clientside.no_update;
  return `/compare/${ids.join(",")}`;
}
