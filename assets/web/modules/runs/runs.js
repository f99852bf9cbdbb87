// The page Runs: how cells look, and sending a file to be imported. Whatever people wrote reaches the
// page as text nodes.

import { around, CONSTANTS, goTo, setProps } from "../kit/page.js";
import { clock } from "../kit/time.js";

/** @param {...any} given */
const element = (...given) => window.React.createElement(...given);

// ---- cells ----------------------------------------------------------------------------------

/** @template T @param {(value: T) => string} show */
const ifAny = (show) => (/** @type {T | null | undefined} */ value) =>
  value === null || value === undefined ? "" : show(value);

const FUNCTIONS = {
  runFixed: (/** @type {number | null} */ value, /** @type {number} */ digits) =>
    ifAny((/** @type {number} */ given) =>
      given.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits }),
    )(value),
  runMinute: (/** @type {string} */ value) => value.slice(0, "yyyy-mm-dd hh:mm".length),
  runClock: ifAny(clock),
};

/** @param {any} props */
function RunLink(props) {
  const path = CONSTANTS.runPrefix + props.data.id;
  const open = (/** @type {MouseEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    goTo(path);
  };
  // The grid keeps the focus on its cells: Enter on one opens the run, as the link does.
  props.eGridCell.onkeydown = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Enter") goTo(path);
  };
  return element("a", { href: path, onClick: open, tabIndex: -1 }, props.value);
}

/** @param {any} props */
function RunVerdict(props) {
  const { right, share } = props.data;
  if (!props.value) return null;
  return element(
    "span",
    { className: "runs-verdict" },
    element(
      "span",
      { className: "runs-mark", "data-right": String(right), title: right ? "Right" : "Wrong" },
      right ? "✓" : "✗",
      element("span", { className: "visually-hidden" }, right ? "right: " : "wrong: "),
    ),
    element("span", { className: "runs-name", title: props.value }, props.value),
    element("span", { className: "note" }, `${Math.round(100 * share)} %`),
  );
}

/** @param {any} props */
function RunBadge(props) {
  return element("span", { className: "badge", "data-status": props.data.status }, props.value);
}

/** @param {any} props */
function RunTags(props) {
  const tags = (props.value || "").split(", ").filter(Boolean);
  return tags.map((/** @type {string} */ tag) =>
    element("span", { className: "runs-tag", key: tag }, tag),
  );
}

// ---- importing ------------------------------------------------------------------------------

/** @param {File} file */
async function send(file) {
  const report = (/** @type {object} */ data) =>
    setProps("runs-imported", { data: { ...data, at: Date.now() } });
  setProps("runs-notice", { children: `Importing ${file.name}…` });
  setProps("runs-problem", { children: "" });
  try {
    const headers = { "Content-Type": "application/zip" };
    const answer = await fetch(CONSTANTS.importPath, { method: "POST", headers, body: file });
    report(await answer.json());
  } catch {
    report({ problem: "The file could not be sent. Is the server still there?" });
  }
}

function chooseFile() {
  const input = document.createElement("input");
  input.type = "file";
  input.accept = ".zip,application/zip";
  input.addEventListener("change", () => {
    if (input.files?.length) send(input.files[0]);
  });
  input.click();
}

export function start() {
  window.dashAgGridFunctions = Object.assign(window.dashAgGridFunctions || {}, FUNCTIONS);
  window.dashAgGridComponentFunctions = Object.assign(window.dashAgGridComponentFunctions || {}, {
    RunLink,
    RunVerdict,
    RunBadge,
    RunTags,
  });
  document.addEventListener("click", (event) => {
    if (around(event, "#runs-import")) chooseFile();
  });
}
