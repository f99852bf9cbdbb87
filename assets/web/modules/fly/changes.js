// What changes on the page Fly, and who of its parts is told: all of them know the flight and the
// cursor, and neither of these knows them.

import { signal } from "../kit/signal.js";

/**
 * @typedef {import("../kit/plot.js").Span} Span
 * @typedef {object} Mark
 * @property {string} kind onset, evidence, named, action or limit
 * @property {number} time_s
 * @property {string} label
 * @property {number} [end_s]
 * @property {string} [channel]
 */

/** It is another flight: nothing of the last one is left. The Plotly charts get theirs from the server. */
export const flightReplaced = /** @type {ReturnType<typeof signal<void>>} */ (signal());

/** The flight has more samples, or is another one. */
export const flightChanged = /** @type {ReturnType<typeof signal<void>>} */ (signal());

/** A part of the flight has finer samples, or has them no more. */
export const flightRefined = /** @type {ReturnType<typeof signal<void>>} */ (signal());

/** Readings are to be shown in other units. */
export const unitsChanged = /** @type {ReturnType<typeof signal<void>>} */ (signal());

/** The time cursor is elsewhere; null: it points at nothing. */
export const cursorMoved = /** @type {ReturnType<typeof signal<number | null>>} */ (signal());

/** Another part of the flight is shown; null: all of it. */
export const zoomChanged = /** @type {ReturnType<typeof signal<Span | null>>} */ (signal());

/** Other moments are marked. */
export const marksChanged = /** @type {ReturnType<typeof signal<Mark[]>>} */ (signal());

/**
 * The cursors A and B are elsewhere.
 * @type {ReturnType<typeof signal<{ a_s: number | null, b_s: number | null }>>}
 */
export const betweenChanged = signal();
