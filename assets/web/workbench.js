// The pages beside Fly: what only the browser can do for them.

(function () {
  "use strict";

  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    workbench: {
      nameTab(title) {
        if (title) document.title = title;
      },
    },
  });
})();
