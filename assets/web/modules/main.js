// The entry of the scripts: what Dash calls in the browser, and what listens to the page from the
// start. `app/scripts.py` has the renderer wait for it.

import * as paths3d from "./compare/paths3d.js";
import * as between from "./fly/between.js";
import * as controls from "./fly/controls.js";
import * as cursor from "./fly/cursor.js";
import * as detail from "./fly/detail.js";
import * as engine from "./fly/engine.js";
import * as marks from "./fly/marks.js";
import * as plotlyCharts from "./fly/plotly_charts.js";
import * as present from "./fly/present.js";
import * as ranking from "./fly/ranking.js";
import * as report from "./fly/report.js";
import * as tiles from "./fly/tiles.js";
import * as units from "./fly/units.js";
import * as zoom from "./fly/zoom.js";
import { into } from "./kit/draw.js";
import { watchKeys } from "./kit/keys.js";
import { watchScheme } from "./kit/theme.js";
import * as runs from "./runs/runs.js";
import { chosen, compare, search } from "./runs/selection.js";
import * as app from "./shell/app.js";
import * as aria from "./shell/aria.js";
import * as numberFields from "./shell/number_fields.js";
import * as terms from "./shell/terms.js";
import * as tour from "./shell/tour.js";
import * as charts from "./teach/charts.js";
import * as menu from "./teach/menu.js";
import * as teach from "./teach/teach.js";

// Keys and changes reach these in this order: what is on top of the page comes first, and what draws
// comes after what it draws.
const PARTS = [
  aria,
  terms,
  tour,
  numberFields,
  app,
  cursor,
  zoom,
  between,
  marks,
  tiles,
  plotlyCharts,
  ranking,
  engine,
  detail,
  controls,
  report,
  present,
  paths3d,
  runs,
  menu,
  charts,
  teach,
];

window.dash_clientside = Object.assign(window.dash_clientside ?? {}, {
  mirrortwin: {
    markPage: app.markPage,
    showRun: app.showRun,
    severityText: app.severityText,
  },
  workbench: { nameTab: app.nameTab },
  tiles: { showFlight: tiles.showFlight },
  flight: { chooseUnits: units.chooseUnits },
  cursor: { scrub: cursor.scrub, setSpeed: cursor.setSpeed, showMarks: marks.showMarks },
  ranking: { take: ranking.take },
  draw: { report: into("report"), answers: into("answers"), ranking: into("ranking") },
  present: { follow: present.follow },
  tour: { invite: tour.invite },
  runs: { search, chosen, compare },
  paths3d: { dress: paths3d.dress },
  teach: { draw: charts.draw, learner: teach.learner },
});

watchScheme();
watchKeys();
for (const part of PARTS) part.start();
