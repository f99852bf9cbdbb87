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
      chosen(rows) {
        const chosen = rows || [];
        const done = chosen.filter((row) => row.status === "done");
        const all = chosen.length > 0 && done.length === chosen.length;
        const one = all && chosen.length === 1 ? chosen[0].id : null;
        const comparable = all && chosen.length <= MAX_COMPARED;
        const zip = all ? `/runs/files?${chosen.map((row) => `id=${row.id}`).join("&")}` : "#";
        return [
          !comparable,
          chosen.length > 1 ? `Compare ${chosen.length}` : "Compare",
          !all,
          chosen.length === 0,
          zip,
          !all,
          one ? `/runs/${one}/faulted.csv` : "#",
          !one,
          one ? `/runs/${one}/mirror.csv` : "#",
          !one,
        ];
      },
      compare(clicks, rows) {
        if (!clicks || !rows || !rows.length) return window.dash_clientside.no_update;
        return `/compare/${rows.map((row) => row.id).join(",")}`;
      },
    },
  });
})();
