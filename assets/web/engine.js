// The engine view: a flat four from above with EGT and CHT on each cylinder, and gauges beside it,
// read at the time cursor. What a gauge is comes from `app/figures/engine_view.py`, its colours from
// `engine.css`. It is drawn once a frame at most, and only what has changed.

(function () {
  "use strict";

  const SVG = "http://www.w3.org/2000/svg";
  const CYLINDER = { width: 176, height: 92 };
  // Where the cylinders lie, from above, nose up: inner end of each, and which way it points.
  const PLACES = { 1: [258, 34, 1], 2: [202, 44, -1], 3: [258, 142, 1], 4: [202, 152, -1] };
  const SPOTS = { 1: "right front", 2: "left front", 3: "right rear", 4: "left rear" };
  const BAR = 144;
  const ARC = { x: 84, y: 74, radius: 56, from: -210, to: 30 };
  const GROUPS = [
    ["Oil", ["E1 OilT", "E1 OilP"]],
    ["Fuel", ["FQtyL", "FQtyR", "E1 FFlow"]],
    ["Electrical", ["volt1", "volt2", "amp1", "amp2"]],
  ];
  const WORDS = { limit: "beyond its limit", caution: "outside its green arc" };

  let host = null;
  let gauges = [];
  let inView = true;
  let due = null;

  const flight = () => window.dash_clientside.flight;
  const indexOf = (name) => flight().specs.findIndex((spec) => spec.name === name);

  // ---- drawing ------------------------------------------------------------------------------

  function draw(name, attributes, parent, text) {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  }

  function make(name, className, parent, text) {
    const node = document.createElement(name);
    node.className = className;
    if (text !== undefined) node.textContent = text;
    if (parent) parent.append(node);
    return node;
  }

  // Share of the scale, 0 to 1.
  const share = ({ low, high }, value) => Math.min(Math.max((value - low) / (high - low), 0), 1);

  // The stretch of the scale that a reading lies in; the outer ones have no outer end.
  function statusOf({ bands }, value) {
    const band = bands.find(({ to }) => value <= to) || bands[bands.length - 1];
    return band.status;
  }

  const greenOf = ({ scale }) => scale.bands.find(({ status }) => status === "normal");

  // A bar from the scale's zero, or its low end, to the reading; drawn from 0 to `length`.
  function bar(parent, gauge, length, height) {
    draw("rect", { class: "track", width: length, height, rx: 2 }, parent);
    for (const band of gauge.bands) {
      const from = length * share(gauge, band.from);
      const width = Math.max(length * share(gauge, band.to) - from, 0);
      draw("rect", { class: `band ${band.status}`, x: from, y: height + 1.5, width, height: 2.5 }, parent);
    }
    const fill = draw("rect", { class: "fill", height, rx: 1.5 }, parent);
    const ghost = draw("rect", { class: "ghost", height, rx: 1.5 }, parent);
    for (const limit of gauge.red) {
      const x = length * share(gauge, limit);
      draw("line", { class: "redline", x1: x, x2: x, y1: -2.5, y2: height + 4 }, parent);
    }
    const zero = share(gauge, 0) * length;
    return {
      fill: (value) => stretch(fill, zero, length * share(gauge, value)),
      ghost: (value) => stretch(ghost, zero, length * share(gauge, value)),
    };
  }

  function stretch(rect, from, to) {
    rect.setAttribute("x", Math.min(from, to).toFixed(1));
    rect.setAttribute("width", Math.max(Math.abs(to - from), 0.5).toFixed(1));
  }

  function pointOn(angle_deg, radius) {
    const angle = (angle_deg * Math.PI) / 180;
    return [ARC.x + radius * Math.cos(angle), ARC.y + radius * Math.sin(angle)];
  }

  function arcPath(from, to, radius) {
    const [x1, y1] = pointOn(from, radius);
    const [x2, y2] = pointOn(to, radius);
    return `M${x1} ${y1} A${radius} ${radius} 0 ${to - from > 180 ? 1 : 0} 1 ${x2} ${y2}`;
  }

  const angleOf = (gauge, value) => ARC.from + (ARC.to - ARC.from) * share(gauge, value);

  function dial(parent, gauge) {
    draw("path", { class: "track-arc", d: arcPath(ARC.from, ARC.to, ARC.radius) }, parent);
    for (const band of gauge.bands) {
      const [from, to] = [angleOf(gauge, band.from), angleOf(gauge, band.to)];
      if (to > from) draw("path", { class: `band-arc ${band.status}`, d: arcPath(from, to, ARC.radius + 7) }, parent);
    }
    for (const limit of gauge.red) {
      const [[x1, y1], [x2, y2]] = [ARC.radius - 6, ARC.radius + 10].map((r) => pointOn(angleOf(gauge, limit), r));
      draw("line", { class: "redline", x1, y1, x2, y2 }, parent);
    }
    const needle = (kind, reach) =>
      draw("line", { class: kind, x1: ARC.x + 26, x2: ARC.x + reach, y1: ARC.y, y2: ARC.y }, parent);
    const [ghost, fill] = [needle("needle-ghost", ARC.radius + 3), needle("needle", ARC.radius + 3)];
    const turn = (line) => (value) =>
      line.setAttribute("transform", `rotate(${angleOf(gauge, value).toFixed(2)} ${ARC.x} ${ARC.y})`);
    return { fill: turn(fill), ghost: turn(ghost) };
  }

  // ---- the engine ---------------------------------------------------------------------------

  function engine() {
    const svg = draw("svg", { viewBox: "0 0 460 256", class: "engine-drawing" });
    const metal = draw("g", { class: "metal", "aria-hidden": "true" }, svg);
    draw("path", { class: "blade", d: "M230 8 C190 0 120 2 92 8 C120 14 190 15 230 10 Z M230 8 C270 15 340 14 368 8 C340 2 270 0 230 8 Z" }, metal);
    draw("path", { class: "spinner", d: "M216 18 C218 6 224 1 230 1 C236 1 242 6 244 18 Z" }, metal);
    draw("rect", { class: "case", x: 210, y: 18, width: 40, height: 8, rx: 2 }, metal);
    draw("path", { class: "case", d: "M208 26 H252 L258 36 V236 L250 246 H210 L202 236 V36 Z" }, metal);
    draw("line", { class: "seam", x1: 230, x2: 230, y1: 30, y2: 244 }, metal);
    for (const x of [211, 234]) draw("rect", { class: "case", x, y: 244, width: 15, height: 11, rx: 2 }, metal);
    for (const [cylinder, place] of Object.entries(PLACES)) drawCylinder(svg, metal, cylinder, place);
    return svg;
  }

  function drawCylinder(svg, metal, cylinder, [inner, top, way]) {
    const { width, height } = CYLINDER;
    const x = way > 0 ? inner : inner - width;
    const body = draw("g", { transform: `translate(${inner} ${top}) scale(${way} 1)` }, metal);
    for (let fin = 8; fin < width - 16; fin += 6) {
      draw("line", { class: "fin", x1: fin, x2: fin, y1: -3, y2: height + 3 }, body);
    }
    draw("rect", { class: "barrel", width: width - 10, height }, body);
    draw("path", { class: "head", d: `M${width - 18} -3 H${width - 6} Q${width + 4} -3 ${width + 4} 8 V${height - 8} Q${width + 4} ${height + 3} ${width - 6} ${height + 3} H${width - 18} Z` }, body);
    const badge = way > 0 ? x + width - 7 : x + 7;
    draw("text", { class: "cylinder-number", x: badge, y: top + height / 2 + 5 }, svg, cylinder);
    const left = way > 0 ? x + 8 : x + width - 8 - BAR;
    for (const [kind, down] of [["EGT", 2], ["CHT", 46]]) {
      const index = indexOf(`E1 ${kind}${cylinder}`);
      const group = draw("g", { transform: `translate(${left} ${top + down})` }, svg);
      draw("text", { class: "gauge-name", y: 14 }, group, kind);
      const value = draw("text", { class: "gauge-value", x: BAR / 2 + 24, y: 14 }, group);
      const difference = draw("text", { class: "gauge-difference", x: BAR, y: 14 }, group);
      const mirrored = way > 0 ? "translate(0 20)" : `translate(${BAR} 20) scale(-1 1)`;
      const bars = bar(draw("g", { transform: mirrored }, group), flight().specs[index].gauge, BAR, 13);
      gauges.push({ index, group, value, difference, ...bars, place: `cylinder ${cylinder}, ${SPOTS[cylinder]}` });
    }
  }

  // ---- the gauges beside it -----------------------------------------------------------------

  function tachometer() {
    const index = indexOf("E1 RPM");
    const group = make("div", "gauge-cell tachometer");
    const svg = draw("svg", { viewBox: "0 0 168 112", "aria-hidden": "true" }, group);
    const hands = dial(svg, flight().specs[index].gauge);
    const value = draw("text", { class: "dial-value", x: ARC.x, y: ARC.y + 4 }, svg);
    const difference = draw("text", { class: "dial-difference", x: ARC.x, y: ARC.y + 19 }, svg);
    draw("text", { class: "dial-name", x: ARC.x, y: ARC.y + 36 }, svg, flight().specs[index].label);
    gauges.push({ index, group, value, difference, ...hands });
    return group;
  }

  function linear(name) {
    const index = indexOf(name);
    const spec = flight().specs[index];
    const group = make("div", "gauge-cell");
    make("span", "gauge-name", group, spec.label);
    const value = make("span", "gauge-value", group);
    const difference = make("span", "gauge-difference", group);
    const svg = draw("svg", { viewBox: "0 -3 100 17", preserveAspectRatio: "none", "aria-hidden": "true" }, group);
    gauges.push({ index, group, value, difference, ...bar(svg, spec.gauge, 100, 9) });
    return group;
  }

  function build(root) {
    host = root;
    gauges = [];
    const drawing = make("div", "engine-figure");
    drawing.append(engine());
    make("p", "note engine-spread", drawing);
    const side = make("div", "engine-gauges");
    for (const [title, names] of GROUPS) {
      const group = make("div", "gauge-group", side);
      make("h3", "chart-title", group, title);
      group.append(...names.map(linear));
    }
    root.replaceChildren(drawing, tachometer(), side);
    for (const gauge of gauges) {
      const { label, gauge: scale } = flight().specs[gauge.index];
      gauge.name = label;
      gauge.scale = scale;
      gauge.group.setAttribute("role", "meter");
      gauge.group.setAttribute("aria-label", gauge.place ? `${label}, ${gauge.place}` : label);
      gauge.group.setAttribute("aria-valuemin", scale.low);
      gauge.group.setAttribute("aria-valuemax", scale.high);
    }
    new IntersectionObserver((sightings) => {
      inView = sightings[sightings.length - 1].isIntersecting;
      if (inView) ask();
    }).observe(root);
  }

  // ---- reading ------------------------------------------------------------------------------

  function write(node, text) {
    if (node.textContent !== text) node.textContent = text;
  }

  function read(gauge, time_s) {
    const spec = flight().specs[gauge.index];
    const reading = flight().at(gauge.index, time_s);
    gauge.group.dataset.empty = reading === null;
    if (reading === null) {
      write(gauge.value, "–");
      write(gauge.difference, "");
      gauge.fill(gauge.scale.low);
      gauge.ghost(gauge.scale.low);
      gauge.group.setAttribute("aria-valuenow", gauge.scale.low); // a meter must have one
      gauge.group.setAttribute("aria-valuetext", "no reading");
      gauge.status = "normal";
      return;
    }
    const { value, difference, label, decimals } = flight().shown(spec);
    const { number, signed } = flight();
    gauge.status = statusOf(gauge.scale, reading.faulted);
    const text = `${number(value(reading.faulted), decimals)} ${label}`;
    const beyond = gauge.status === "limit" || gauge.status === "caution";
    const sign = beyond ? (reading.faulted > greenOf(gauge).from ? "▲ " : "▼ ") : "";
    write(gauge.value, sign + text);
    write(gauge.difference, signed(difference(reading.faulted - reading.mirror), decimals));
    gauge.text = text;
    gauge.fill(reading.faulted);
    gauge.ghost(reading.mirror);
    gauge.group.dataset.status = gauge.status;
    gauge.group.setAttribute("aria-valuenow", reading.faulted.toFixed(spec.decimals));
    gauge.group.setAttribute("aria-valuetext", beyond ? `${text}, ${WORDS[gauge.status]}` : text);
  }

  // How far apart the cylinders are, which engine monitors call DIF.
  function spread(kind, time_s) {
    const read = gauges.filter((gauge) => gauge.name.startsWith(kind))
      .map((gauge) => flight().at(gauge.index, time_s));
    if (!read.length || read.includes(null)) return "";
    const spec = flight().specs[gauges.find((gauge) => gauge.name.startsWith(kind)).index];
    const { difference, label } = flight().shown(spec);
    const width = (of) => {
      const values = read.map((reading) => reading[of]);
      return difference(Math.max(...values) - Math.min(...values)).toFixed(0);
    };
    return `${kind} ${width("faulted")} ${label} (mirror ${width("mirror")})`;
  }

  // "EGT 1, 2, Oil pressure": the kind once.
  function shortList(names) {
    const kind = (name) => name.replace(/ \d$/, "");
    return names
      .map((name, at) => (at > 0 && name !== kind(name) && kind(names[at - 1]) === kind(name) ? name.slice(-1) : name))
      .join(", ");
  }

  function tell(time_s) {
    const { clock, flownUntil } = flight();
    const flown_s = flownUntil();
    write(document.getElementById("engine-time"), flown_s > 0 ? `at ${clock(time_s ?? flown_s)}` : "");
    const spreads = [spread("EGT", time_s), spread("CHT", time_s)].filter(Boolean).join(", ");
    write(host.querySelector(".engine-spread"), spreads ? `Spread: ${spreads}` : "");
    const status = document.getElementById("engine-status");
    const wrong = (kind) => gauges.filter((gauge) => gauge.status === kind);
    const worst = wrong("limit").length ? "limit" : wrong("caution").length ? "caution" : "normal";
    status.dataset.status = flown_s > 0 ? worst : "none";
    const names = shortList(wrong(worst).map((gauge) => gauge.name));
    const words = { limit: `Limit: ${names}`, caution: `Caution: ${names}`, normal: "Within limits" };
    write(status, flown_s > 0 ? words[worst] : "");
  }

  function show() {
    due = null;
    const root = document.getElementById("engine-view");
    if (!root || !flight().specs.length) return;
    if (root !== host || !root.firstChild) build(root);
    if (!inView) return;
    const begun = performance.now();
    const { time_s } = window.dash_clientside.cursor;
    for (const gauge of gauges) read(gauge, time_s);
    tell(time_s);
    root.dataset.drawnMs = (performance.now() - begun).toFixed(1);
  }

  // The first samples are painted first: two frames on.
  function ask() {
    if (due !== null) return;
    const wait = host && host.isConnected ? show : () => requestAnimationFrame(show);
    due = requestAnimationFrame(wait);
  }

  for (const event of ["flightchanged", "cursormoved", "unitschanged"]) {
    document.addEventListener(event, ask);
  }
})();
