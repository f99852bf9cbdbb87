// Calls a function of a module with many arguments, for tests in Python: reads `{module, name, calls}`
// as JSON, with a list of arguments for each call, and writes the list of what they returned.

import { text } from "node:stream/consumers";

const { module, name, calls } = JSON.parse(await text(process.stdin));
const loaded = await import(`../../assets/web/modules/${module}`);
const answers = calls.map((/** @type {unknown[]} */ given) => loaded[name](...given) ?? null);
process.stdout.write(JSON.stringify(answers));
