// Times of the flight as people read them.

/**
 * Seconds from the start of the flight as m:ss, or h:mm:ss from an hour on: what `core.clock.clock`
 * prints of them, which rounds halves to the even second.
 * @param {number} time_s
 */
export function clock(time_s) {
  const nearest = Math.round(time_s);
  const total = nearest - time_s === 0.5 && nearest % 2 !== 0 ? nearest - 1 : nearest;
  const [hours, minutes, seconds] = [total / 3600, (total / 60) % 60, total % 60].map(Math.floor);
  const pad = (/** @type {number} */ number) => String(number).padStart(2, "0");
  return hours ? `${hours}:${pad(minutes)}:${pad(seconds)}` : `${minutes}:${pad(seconds)}`;
}
