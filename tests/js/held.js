// What a page holds of a flight, for tests in Python: reads a request a line, as JSON, and answers in a
// line. `{take: message}` has the page take a message, `{rows: index}` asks what it draws of a channel,
// `{extremes: index}` what it has of its extremes.

import { createInterface } from "node:readline";

import { flight, rows, take } from "../../assets/web/modules/fly/flight.js";

/** @param {any} request */
function answer(request) {
  if (request.take) {
    take(request.take);
    return { key: flight.key, count: flight.count };
  }
  if (request.extremes !== undefined) return flight.extremes[request.extremes];
  return rows(request.rows);
}

for await (const line of createInterface({ input: process.stdin })) {
  process.stdout.write(`${JSON.stringify(answer(JSON.parse(line)))}\n`);
}
