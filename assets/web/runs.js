// The page Runs: how cells look, what the buttons apply to, and sending a file to be imported.
// Whatever people wrote reaches the page as text nodes.

(function () {
  "use strict";

  const MAX_COMPARED = 6;
  const element = (...given) => window.React.createElement(...given);

  const setProps = (id, props) => window.dash_clientside.mirrortwin.setProps(id, props);
  const goTo = (path) => setProps("url", { pathname: path });

  window.dashAgGridFunctions = Object.assign(window.dashAgGridFunctions || {}, {
    runFixed: (value, digits) =>
      value === null || value === undefined
        ? ""
        : value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits }),
    runMinute: (value) => value.slice(0, 16),
    runClock: (value) =>
      value === null || value === undefined
        ? ""
        : `${Math.floor(value / 60)}:${String(Math.floor(value % 60)).padStart(2, "0")}`,
  });

  window.dashAgGridComponentFunctions = Object.assign(window.dashAgGridComponentFunctions || {}, {
    RunLink(props) {
      const path = `/run/${props.data.id}`;
      const open = (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        event.preventDefault();
        goTo(path);
      };
      // The grid keeps the focus on its cells: Enter on one opens the run, as the link does.
      props.eGridCell.onkeydown = (event) => {
        if (event.key === "Enter") goTo(path);
      };
      return element("a", { href: path, onClick: open, tabIndex: -1 }, props.value);
    },
    RunVerdict(props) {
      const { right, share } = props.data;
      if (!props.value) return null;
      return element(
        "span",
        { className: "runs-verdict" },
        element(
          "span",
          { className: "runs-mark", "data-right": String(right), title: right ? "Right" : "Wrong" },
          right ? "✓" : "✗",
          element("span", { className: "visually-hidden" }, right ? "right: " : "wrong: ")
        ),
        element("span", { className: "runs-name", title: props.value }, props.value),
        element("span", { className: "note" }, `${Math.round(100 * share)} %`)
      );
    },
    RunBadge(props) {
      return element("span", { className: "badge", "data-status": props.data.status }, props.value);
    },
    RunTags(props) {
      const tags = (props.value || "").split(", ").filter(Boolean);
      return tags.map((tag) => element("span", { className: "runs-tag", key: tag }, tag));
    },
  });

  const send = async (file) => {
    const tell = (data) => setProps("runs-imported", { data });
    const notice = (text) => setProps("runs-notice", { children: text });
    notice(`Importing ${file.name}…`);
    setProps("runs-problem", { children: "" });
    try {
      const answer = await fetch("/runs/import", {
        method: "POST",
        headers: { "Content-Type": "application/zip" },
        body: file,
      });
      tell({ ...(await answer.json()), at: Date.now() });
    } catch {
      tell({ problem: "The file could not be sent. Is the server still there?", at: Date.now() });
    }
  };

  document.addEventListener("click", (event) => {
    if (!event.target.closest("#runs-import")) return;
    const input = document.createElement("input");
    input.type = "file";
    input.accept = ".zip,application/zip";
    input.addEventListener("change", () => input.files.length && send(input.files[0]));
    input.click();
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    runs: {
      search: (text, options) => ({ ...options, quickFilterText: text || "" }),
      // What the buttons apply to: the rows that are selected and pass search and filters, as they are
      // now. The grid keeps rows selected that it hides, and hands out as they were when selected.
      chosen(selected, seen) {
        const rows = new Map((seen || []).map((row) => [row.id, row]));
        const chosen = (selected || []).map((row) => rows.get(row.id)).filter(Boolean);
        const hidden = (selected || []).length - chosen.length;
        const ids = chosen.map((row) => row.id);
        const all = ids.length > 0 && chosen.every((row) => row.status === "done");
        const one = all && ids.length === 1 ? ids[0] : null;
        const zip = all ? `/runs/files?${ids.map((id) => `id=${id}`).join("&")}` : "#";
        const counted = (word) => (ids.length ? `${word} ${ids.length}` : word);
        return [
          ids,
          hidden ? `${hidden} more selected, hidden by the filter` : "",
          counted("Compare"),
          !(all && ids.length <= MAX_COMPARED),
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
      },
      compare(clicks, ids) {
        if (!clicks || !ids || !ids.length) return window.dash_clientside.no_update;
        return `/compare/${ids.join(",")}`;
      },
    },
  });
})();
