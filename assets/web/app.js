// The little that must happen in the browser: keyboard and theme. `tiles.js` draws the channels;
// everything else is Dash.

(function () {
  "use strict";

  const schemeOf = () =>
    document.documentElement.getAttribute("data-mantine-color-scheme") || "light";

  // Whether a component is on the page; Dash's own question throws if it is not.
  function isThere(id) {
    try {
      return window.dash_component_api.getLayout(id) !== undefined;
    } catch {
      return false;
    }
  }

  // Sets properties of a component, if its page has not been left meanwhile. All of `assets` sets them
  // by this: Dash's `set_props` throws where the component has gone, and timers and answers come late.
  function setProps(id, props) {
    if (isThere(id)) window.dash_clientside.set_props(id, props);
  }

  // The server draws the 3D scenes, so it has to know the theme.
  function reportScheme() {
    setProps("scheme", { data: schemeOf() });
  }

  new MutationObserver(reportScheme).observe(document.documentElement, {
    attributes: true,
    attributeFilter: ["data-mantine-color-scheme"],
  });

  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) setProps("awake", { data: Date.now() });
  });

  document.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
    const run = document.getElementById("run");
    if (!run || run.disabled) return;
    event.preventDefault();
    // A number field tells Dash its value when it loses the focus, and Dash takes a moment to hear
    // it: let that be over first, or the flight is flown with the value before.
    if (document.activeElement) document.activeElement.blur();
    setTimeout(() => run.click(), 100);
  });

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    mirrortwin: {
      setProps,
      markPage(kind) {
        for (const link of document.querySelectorAll(".header a[id^=nav-]")) {
          if (link.id === `nav-${kind}`) link.setAttribute("aria-current", "page");
          else link.removeAttribute("aria-current");
        }
        // The 3D view starts on this report: let the page itself come first.
        if (kind) requestIdleCallback(reportScheme, { timeout: 1500 });
      },
      // On a narrow screen the form fills the view: bring the run that it started into sight.
      showRun(runId) {
        const bar = document.querySelector(".area-bar");
        if (runId && bar && window.innerWidth < 800) bar.scrollIntoView();
      },
      severityText(value) {
        return Number(value).toFixed(2);
      },
    },
  });
})();
