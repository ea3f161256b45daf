// Interactive plots: all models above, their differences and the threshold below, one cursor for all.
"use strict";

// A thin line on a wide, pale one shows both where they coincide.
const STYLES = [{name: "first", alpha: "99", width: 4.5}, {name: "second", alpha: "", width: 1.5}, {name: "third", alpha: "", width: 0.8}];
const SIGNS = {agree: "✓", differ: "✗", indeterminate: "?"};
const FONT = "12px system-ui, sans-serif";

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in made) made[key] = value; else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const stroke = side => colour(STYLES[side].name) + STYLES[side].alpha;

// ---- numbers

// Factor and prefix that bring a magnitude to between 1 and 10000; degrees and the like take none.
function prefix(magnitude, unit) {
  if (!unit || /^(deg|%|1)/.test(unit)) return [1, ""];
  if (magnitude >= 1e4) return [1e3, "k"];
  return [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]].find(([least]) => magnitude >= least * 0.9995) || [1, ""];
}

function quantity(value, unit) {
  if (value === null || value === undefined || Number.isNaN(value)) return "n/a";
  const size = Math.abs(value), [factor, letter] = prefix(size, unit);
  const text = size && size < 0.001 * factor ? (value / factor).toExponential(2) : String(+(value / factor).toPrecision(4));
  return `${text} ${letter}${unit}`.trim();
}

// Decimals that tell neighbouring ticks apart.
function decimals(step) {
  for (let n = 0; n < 12; n++) if (Math.abs(step * 10 ** n - Math.round(step * 10 ** n)) < 1e-6 * step * 10 ** n) return n;
  return 12;
}

const tickLabels = (...given) => tickTexts(...given).map(text => text.replace("-", "−"));

// The last tick has the unit. Where ticks differ in late digits only, the first is written in full and the others as
// what they are beyond it.
function tickTexts(splits, unit, scaled = true) {
  const last = splits.length - 1;
  if (last < 1) return splits.map(v => quantity(v, unit));
  const step = splits[1] - splits[0], most = Math.max(...splits.map(Math.abs));
  const whole = scaled ? prefix(most, unit) : [1, ""];
  if (most > 2000 * step) {
    const [factor, letter] = prefix(splits[last] - splits[0], unit), digits = decimals(step / factor);
    const first = (splits[0] / whole[0]).toPrecision(Math.min(12, Math.ceil(Math.log10(most / step)) + 1));
    return splits.map((v, i) => i ? `+${((v - splits[0]) / factor).toFixed(digits)}` + (i === last ? ` ${letter}${unit}` : "")
      : first + (scaled ? ` ${whole[1]}${unit}` : ""));
  }
  const [factor, letter] = whole, digits = decimals(step / factor);
  return splits.map((v, i) => (v / factor).toFixed(digits) + (scaled && i === last && letter + unit ? ` ${letter}${unit}` : ""));
}

// ---- data

async function inflate(text) {
  const packed = Uint8Array.from(atob(text.trim()), c => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).json();
}

function unpack(head) {
  const models = head.labels.length;
  head.t = head.time.map(t => head.start + t);
  head.pairs = [];
  for (let a = 0; a < models; a++) for (let b = a + 1; b < models; b++) head.pairs.push([a, b]);
  const sums = steps => { let at = 0; return steps.map(k => at += k); };
  const octaves = steps => sums(steps).map(k => k && Math.sign(k) * 2 ** ((Math.abs(k) - 40000) / 32));
  for (const c of head.channels) {
    const [lowest, step] = c.grid, first = sums(sums(c.steps)).map(k => (lowest + k) * step);
    const apart = [first.map(() => 0), ...c.apart.map(octaves)], limit = c.limit && octaves(c.limit);
    c.values = apart.map((e, k) => k ? first.map((v, i) => v - e[i]) : first);
    c.differences = head.pairs.map(([a, b]) => apart[b].map((e, i) => e - apart[a][i]));
    c.sizes = c.differences.map(e => e.map(Math.abs));
    c.threshold = Boolean(limit);
    c.within = limit && limit.map(Math.abs);
    c.judged = first.map((_, i) => !limit || limit[i] >= 0);
    c.ratio = limit && c.sizes[0].map((v, i) => c.judged[i] && c.within[i] ? v / c.within[i] : null);
  }
  // Contacts resolved at a model's own steps.
  head.pulses = head.pulses.map((list, side) => list.map(({place, last, peak, t, n}) => {
    const [corner, start] = head.contacts[side][place];
    return {corner, place, start, end: start + last, most: peak, t: t.map(v => start + v / 255 * last), n: n.map(v => v / 255 * peak)};
  }));
  return head;
}

// The drawn curves of a channel as CSV, a unit in every heading.
function table(data, c) {
  const {labels, pairs, t} = data, quoted = text => /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  const curve = `${c.guide ? "x - guide" : c.name} [${c.unit || "1"}]`, digits = (values, n) => values.map(v => +v.toPrecision(n));
  const columns = [["time [s]", digits(t, 12)], ...labels.map((label, k) => [`${label} ${curve}`, digits(c.values[k], 9)])];
  pairs.forEach(([a, b], n) => columns.push([`${labels[a]} - ${labels[b]} [${c.unit || "1"}]`, digits(c.differences[n], 4)]));
  if (c.threshold) columns.push([`${data.threshold} [${c.unit || "1"}]`, digits(c.within, 4)], ["judged [1]", c.judged.map(Number)]);
  return [columns.map(([heading]) => quoted(heading)), ...t.map((_, i) => columns.map(([, values]) => values[i]))].join("\n") + "\n";
}

// ---- one plot

function shade(u, judged, t) {
  const {ctx, bbox} = u, half = bbox.width / 800;
  ctx.save();
  ctx.fillStyle = colour("shade");
  let from = -1;
  for (let i = 0; i <= t.length; i++) {
    const off = i < t.length && !judged[i];
    if (off && from < 0) from = i;
    if (!off && from >= 0) {
      const left = Math.max(bbox.left, u.valToPos(t[from], "x", true) - half);
      const right = Math.min(bbox.left + bbox.width, u.valToPos(t[i - 1], "x", true) + half);
      if (right > left) ctx.fillRect(left, bbox.top, right - left, bbox.height);
      from = -1;
    }
  }
  ctx.restore();
}

// Peaks of contacts that are not resolved, each in the middle of its contact.
function peaks(data, contact) {
  return data.contacts.map((list, side) => {
    const resolved = new Set(data.pulses[side].map(p => p.place));
    return list.filter((k, place) => k[0] === contact && !resolved.has(place)).map(k => [k[1] + k[2] / 2, k[3]]);
  });
}

function drawContacts(u, pulses, marks) {
  const {ctx, bbox} = u, {min, max} = u.scales.x, r = 3 * devicePixelRatio;
  const place = (t, value) => [u.valToPos(t, "x", true), u.valToPos(value, "y", true)];
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  pulses.forEach((list, side) => {
    ctx.strokeStyle = stroke(side);
    ctx.lineWidth = STYLES[side].width * devicePixelRatio;
    for (const p of list) {
      if (p.end < min || p.start > max) continue;
      ctx.beginPath();
      p.t.forEach((t, i) => ctx.lineTo(...place(t, p.n[i])));
      ctx.stroke();
    }
  });
  ctx.restore();
  marks.forEach((list, side) => {
    ctx.fillStyle = colour(STYLES[side].name);
    for (const [t, value] of list) {
      if (t < min || t > max) continue;
      const [x, y] = place(t, value), foot = y + (side ? -2 : 2) * r;
      ctx.fillRect(x - r / 6, y, r / 3, place(t, 0)[1] - y);
      ctx.beginPath();
      ctx.moveTo(x, y);
      ctx.lineTo(x - r, foot);
      ctx.lineTo(x + r, foot);
      ctx.fill();
    }
  });
}

// A line on a logarithmic axis, which has no zero: there it falls to the foot of the plot, so that a sample between
// zeros stands as a stem.
function fromFoot(u, side, from, to) {
  const stroke = new Path2D(), values = u.data[side], foot = u.bbox.top + u.bbox.height;
  for (let i = from; i <= to; i++) {
    if (!values[i]) continue;
    const x = u.valToPos(u.data[0][i], "x", true), begins = i === from || !values[i - 1];
    if (begins) stroke.moveTo(x, values[i - 1] === 0 ? foot : u.valToPos(values[i], "y", true));
    stroke.lineTo(x, u.valToPos(values[i], "y", true));
    if (values[i + 1] === 0) stroke.lineTo(x, foot);
  }
  return {stroke};
}

const sparse = u => u.series[0].idxs[1] - u.series[0].idxs[0] < u.bbox.width / 6;

function options(viewer, width, height, extra) {
  const axis = {stroke: colour("ink"), grid: {stroke: colour("grid"), width: 1}, ticks: {stroke: colour("line"), width: 1}, font: FONT};
  return {
    width, height, legend: {show: false},
    cursor: {sync: {key: viewer.key, scales: ["x", null]}, drag: {x: true, y: false, setScale: false}, points: {size: 6}},
    scales: {x: {time: false, min: viewer.range[0], max: viewer.range[1]}, ...extra.scales},
    axes: [
      {...axis, space: 90, values: (u, splits) => tickLabels(splits, "s", false), size: extra.last ? 40 : 24, label: extra.last ? "time (s)" : undefined, labelSize: 18, labelFont: FONT},
      {...axis, size: 100, label: extra.label, labelSize: 18, labelFont: FONT, ...extra.axis},
    ],
    series: [{}, ...extra.series],
    hooks: {
      drawClear: [u => shade(u, extra.judged, viewer.data.t)],
      draw: extra.draw ? [extra.draw] : [],
      setCursor: [u => u.cursor.idx != null && u.cursor.left >= 0 && viewer.at(u.cursor.idx)],
      setSelect: [u => {
        if (u.select.width < 4) return;
        const range = [u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")];
        u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
        viewer.zoom(...range);
      }],
    },
  };
}

function modelsPlot(viewer, c, width) {
  const {data} = viewer, marks = peaks(data, c.contact), pulses = data.pulses.map(list => list.filter(p => p.corner === c.contact));
  // Between samples far apart a line would be drawn through the middle of contacts that are known.
  const lines = uPlot.paths.linear(), paths = (u, ...rest) => pulses.flat().length && sparse(u) ? null : lines(u, ...rest);
  const span = (u, low, high) => {
    // The plot has its new range only after this; what reaches into it counts with its peak.
    const [start, end] = viewer.range;
    for (const [t, value] of marks.flat()) if (t >= start && t <= end) high = Math.max(high, value);
    for (const p of pulses.flat()) if (p.end >= start && p.start <= end) high = Math.max(high, p.most);
    const middle = (low + high) / 2, half = 0.56 * Math.max(high - low, c.least);
    return [middle - half, middle + half];
  };
  return [options(viewer, width, 190, {
    label: c.guide ? "x − guide" : c.label.split(",")[0], judged: c.judged, scales: {y: {range: span}},
    axis: {space: 34, values: (u, splits) => tickLabels(splits, c.unit)},
    series: data.labels.map((label, side) => ({label, stroke: stroke(side), width: STYLES[side].width, paths, points: {show: sparse}})),
    draw: u => drawContacts(u, pulses, marks),
  }), [data.t, ...c.values]];
}

function differencePlot(viewer, c, width) {
  const {data} = viewer, ratio = viewer.ratio && c.threshold;
  // The highest decade is that of `least` or more.
  const log = least => (u, low, high) => {
    high = Math.max(high, least);
    low = Math.max(Math.min(low || high / 1e3, high / 1e3), high * 1e-16);
    return [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high))];
  };
  const splits = (u, axis, low, high) => {
    const first = Math.round(Math.log10(low)), last = Math.round(Math.log10(high)), step = Math.ceil((last - first) / 5) || 1;
    return Array.from({length: Math.floor((last - first) / step) + 1}, (_, i) => 10 ** (first + i * step));
  };
  const values = (u, splits) => splits.map(v => "10" + String(Math.round(Math.log10(v))).replace(/[-\d]/g, d => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(d)]));
  const line = (label, name, width, more = {}) => ({label, stroke: colour(name), width, points: {show: sparse}, ...more});
  const series = [], columns = [];
  if (data.pairs.length === 1) {
    series.push(line("difference", "difference", 1.2, {paths: fromFoot}));
    columns.push(ratio ? c.ratio : c.sizes[0]);
  } else {
    data.pairs.forEach(([a, b], n) => {
      series.push(line(`${data.labels[a]} − ${data.labels[b]}`, `series-${n + 1}`, [3, 1.8, 0.9][n], {paths: fromFoot}));
      columns.push(c.sizes[n]);
    });
  }
  if (c.threshold) {
    series.push(line("threshold", ratio ? "outside" : "threshold", 1.2, {dash: [8, 3, 2, 3], points: {show: false}}));
    series.push(line("beyond", "outside", 0, {paths: () => null, points: {show: true, size: 6, fill: colour("outside")}}));
    columns.push(ratio ? c.ratio.map(() => 1) : c.within);
    const beyond = new Set(c.outside);
    columns.push(c.sizes[0].map((v, i) => beyond.has(i) ? (ratio ? c.ratio[i] : v) : null));
  }
  return [options(viewer, width, 170, {
    label: ratio ? `|difference| / ${data.threshold}` : `|difference| (${c.unit || "1"})`, judged: c.judged, last: true,
    scales: {y: {distr: 3, range: log(ratio ? 2 : c.floor)}}, axis: {values, splits, filter: (u, splits) => splits}, series,
  }), [data.t, ...columns]];
}

// ---- the viewer

class Viewer {
  constructor(root) {
    this.root = root;
    this.key = root.id;
    this.scene = root.id.replace(/--plots$/, "");
    this.blocks = new Map([...root.querySelectorAll("script[data-tier]")].map(s => [s.dataset.tier, s]));
    this.tiers = new Map();
    this.plots = [];
    this.ratio = false;
    this.index = this.clock = 0;
    this.speed = Number(root.dataset.speed || 0);
    this.moved = [];
  }

  async open(tier) {
    this.wanted = tier;
    if (!this.tiers.has(tier)) this.tiers.set(tier, unpack(await inflate(this.blocks.get(tier).textContent)));
    if (this.wanted !== tier) return;
    this.data = this.tiers.get(tier);
    this.tier = tier;
    this.whole = [this.data.t[0], this.data.t[this.data.t.length - 1]];
    this.range ??= this.whole;
    const known = new Set(this.data.channels.map(c => c.name));
    this.shown = new Set([...(this.shown || this.data.first)].filter(name => known.has(name)));
    if (!this.shown.size) this.shown = new Set(this.data.first);
    this.controls();
    this.draw();
  }

  // Puts tier, channels and range into the link, and into the page's address once one of them has been changed.
  link() {
    const [low, high] = this.range, digits = Math.max(0, 3 - Math.floor(Math.log10(high - low)));
    const names = this.data.channels.map(c => c.name).filter(name => this.shown.has(name));
    const parts = [this.scene, this.tier, names.map(encodeURIComponent).join(",")];
    if (high - low < 0.999999 * (this.whole[1] - this.whole[0])) parts.push(`${low.toFixed(digits)}-${high.toFixed(digits)}`);
    const link = this.anchor.href = `#${parts.join("/")}`;
    if (this.linked && this.linked !== link) {
      clearTimeout(renaming);
      renaming = setTimeout(() => history.replaceState(null, "", link), 300);
    }
    this.linked = link;
  }

  controls() {
    const {data} = this, judged = data.channels.some(c => c.threshold), touches = data.contacts.flat().length > 0;
    const group = (legend, ...parts) => element("fieldset", {}, ...(legend ? [element("legend", {}, legend)] : []), ...parts);
    const button = (text, label, action) => element("button", {type: "button", ariaLabel: label, title: label, onclick: action}, text);
    const chip = (type, name, text, checked, action, title = "") => element("label", {className: "chip", title},
      element("input", {type, name, checked, onchange: action}), text);
    const bar = element("div", {className: "bar"});
    if (this.blocks.size > 1) {
      bar.append(group("Tier", ...[...this.blocks.keys()].map(tier => chip("radio", `${this.key}-tier`, tier, tier === this.tier, () => this.open(tier)))));
    }
    if (judged) {
      const lower = (text, ratio) => chip("radio", `${this.key}-view`, text, this.ratio === ratio, () => { this.ratio = ratio; this.draw(); });
      bar.append(group("Lower plots", lower(`|E| and ${data.threshold}`, false), lower(`|E| / ${data.threshold}`, true)));
    }
    bar.append(group("Go to",
      ...(touches ? [button("◂ impact", "Previous impact (p)", () => this.impact(-1)), button("impact ▸", "Next impact (n)", () => this.impact(1))] : []),
      ...(judged ? [button("first beyond", `First sample beyond ${data.threshold} (o)`, () => this.outside())] : []),
      button("+", "Enlarge (+)", () => this.scale(0.5)), button("−", "Reduce (−)", () => this.scale(2)),
      button("whole run", "Whole run (0)", () => this.zoom(...this.whole))));
    this.play = button("", "Play or stop the motion (space)", () => this.toggle());
    this.slider = element("input", {type: "range", min: this.whole[0], max: this.whole[1], step: "any", value: this.data.t[this.index] ?? 0, ariaLabel: "Time",
      oninput: event => this.go(this.near(Number(event.target.value)))});
    const speeds = [["range in 10 s", 0], ["real time", 1], ...[2, 5, 10, 50, 200].map(n => [`1/${n}`, 1 / n])];
    const speed = element("select", {ariaLabel: "Speed of the motion", onchange: event => { this.speed = Number(event.target.value); }},
      ...speeds.map(([text, value]) => element("option", {value, selected: value === this.speed}, text)));
    this.anchor = element("a", {title: "Link to this tier, these channels and this range; the address of the page follows them"}, "Link to this view");
    bar.append(group("", this.play, this.slider, speed), this.anchor);
    const picker = element("details", {className: "picker", open: innerWidth > 700}, element("summary", {}, "Channels"), ...data.channels.map(c =>
      chip("checkbox", c.name, `${SIGNS[c.verdict] || (c.verdict && "!")} ${c.name}`.trim(), this.shown.has(c.name), event => {
        if (event.target.checked) this.shown.add(c.name); else this.shown.delete(c.name);
        this.draw();
      }, c.verdict ? `${c.label}: ${c.verdict}` : c.label)));
    this.boxes = () => { for (const box of picker.querySelectorAll("input")) box.checked = this.shown.has(box.name); };
    this.readout = element("p", {className: "readout", role: "status", "aria-live": "off"});
    this.area = element("div", {className: "plots", tabIndex: 0, role: "group",
      ariaLabel: "Plots. Keys: left and right move the cursor, with shift they pan; plus, minus and 0 zoom; n and p go to the next and previous impact, o to the first sample beyond; space plays."});
    this.area.addEventListener("keydown", event => this.pressed(event));
    this.area.addEventListener("wheel", event => {
      // Without focus the wheel scrolls the page, as everywhere else.
      if (!event.ctrlKey && !this.area.contains(document.activeElement)) return;
      event.preventDefault();
      const over = this.plots[0]?.over.getBoundingClientRect();
      if (over) this.scale(event.deltaY < 0 ? 0.8 : 1.25, this.range[0] + (event.clientX - over.left) / over.width * (this.range[1] - this.range[0]));
    }, {passive: false});
    this.area.addEventListener("pointerdown", () => this.area.focus({preventScroll: true}));
    const help = element("details", {className: "more"}, element("summary", {}, "Keys and marks"), element("p", {className: "soft"}, this.help(judged)));
    this.root.querySelector(".mount").replaceChildren(bar, picker, this.readout, this.area, help);
    this.running(Boolean(this.timer));
  }

  help(judged) {
    const {channels, contacts, pulses, labels, t, of} = this.data;
    const parts = ["Drag to enlarge; click, then the wheel enlarges too (or Ctrl and wheel). Keys: ← → cursor, Shift ← → pan, + − 0 zoom, n p impacts, o first beyond, space plays."];
    if (judged) parts.push("Shaded: not predictable.");
    if (channels.some(c => c.contact >= 0) && contacts.flat().length > pulses.flat().length) parts.push("Triangles: peaks of contacts whose course is not known.");
    if (pulses.flat().length) {
      const counts = labels.map((label, side) => `${pulses[side].length} of ${contacts[side].length} of ${label}`);
      parts.push(`Contacts drawn at the models' own steps between samples: ${counts.join(", ")}; of the others the peak alone.`);
    }
    if (t.length < of) parts.push(`Of ${of} samples ${t.length} are kept, with all envelopes.`);
    parts.push("CSV: the samples of this page, values to 1/65,534 of their range, differences and thresholds to 1.1 %.");
    return parts.join(" ");
  }

  draw() {
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
    this.figures = new Map();
    this.area.replaceChildren();
    this.width = this.area.clientWidth;
    const {labels, pairs, channels} = this.data;
    for (const c of channels.filter(c => this.shown.has(c.name))) {
      const keys = labels.map((label, side) => element("span", {className: `key ${STYLES[side].name}`}, label));
      if (pairs.length > 1) pairs.forEach(([a, b], n) => keys.push(element("span", {className: `key series-${n + 1}`}, `${labels[a]} − ${labels[b]}`)));
      const boxes = [element("div"), element("div")];
      const figure = element("figure", {ariaLabel: `${c.label} over time, of ${labels.join(", ")}, and their difference.${c.verdict && ` Verdict ${c.verdict}.`}`},
        element("p", {className: "legend"}, element("b", {}, c.label), ...keys, this.download(c)), ...boxes);
      this.figures.set(c.name, figure);
      this.area.append(figure);
      const made = [modelsPlot(this, c, this.width), ...(pairs.length ? [differencePlot(this, c, this.width)] : [])];
      made.forEach((plot, n) => this.plots.push(new uPlot(...plot, boxes[n])));
    }
    this.at(this.index);
    this.link();
  }

  download(c) {
    const name = `${[this.scene, this.tier, c.name].filter(Boolean).join("-")}.csv`;
    return element("button", {type: "button", title: `These curves as ${name}`, ariaLabel: `${c.label} as CSV`, onclick: () => {
      const address = URL.createObjectURL(new Blob([table(this.data, c)], {type: "text/csv"}));
      element("a", {href: address, download: name}).click();
      setTimeout(() => URL.revokeObjectURL(address), 1000);
    }}, "CSV");
  }

  zoom(low, high) {
    const [first, last] = this.whole, width = Math.min(Math.max(high - low, 1e-7), last - first);
    low = Math.min(Math.max(low, first), last - width);
    this.range = [low, low + width];
    for (const plot of this.plots) plot.setScale("x", {min: low, max: low + width});
    this.link();
  }

  scale(factor, about = this.data.t[this.index]) {
    const [low, high] = this.range;
    if (about < low || about > high) about = (low + high) / 2;
    this.zoom(about - (about - low) * factor, about + (high - about) * factor);
  }

  // Puts the cursor of all plots at a sample, brings it into view and tells the drawing.
  go(index, playing = false) {
    this.index = Math.min(Math.max(index, 0), this.data.t.length - 1);
    const wanted = this.index, t = this.data.t[wanted], [low, high] = this.range, span = high - low;
    if (t < low || t > high) this.zoom(t - span / 2, t + span / 2);
    else if (playing && t > low + 0.8 * span) this.zoom(t - 0.8 * span, t + 0.2 * span);
    // The plots take a new range over in a microtask; only then is the place of a sample known.
    queueMicrotask(() => {
      for (const plot of this.plots) plot.setCursor({left: plot.valToPos(t, "x"), top: 10}, false);
      this.at(wanted, playing);
    });
  }

  near(time) {
    const t = this.data.t;
    let low = 0, high = t.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] <= time) low = middle; else high = middle; }
    return time - t[low] < t[high] - time ? low : high;
  }

  at(index, playing = false) {
    this.index = index;
    const {data} = this, t = data.t[index], parts = [`t = ${t.toFixed(5)} s`];
    if (!playing) this.clock = t;
    if (data.period) parts.push(`cycle ${(t / data.period + 1e-9).toFixed(3)}`);
    for (const c of data.channels.filter(c => this.shown.has(c.name))) {
      let text = `${c.name}: ${c.values.map(values => quantity(values[index], c.unit)).join(", ")}`;
      if (c.sizes.length === 1) text += `; |E| ${quantity(c.sizes[0][index], c.unit)}`;
      if (c.threshold) text += c.judged[index] ? `, ${(c.ratio[index] || 0).toPrecision(2)} times ${data.threshold}` : ", not predictable";
      parts.push(text);
    }
    if (this.note && this.note.index === index) parts.unshift(this.note.text);
    this.readout.textContent = parts.join("  ·  ");
    this.readout.dataset.time = t;
    this.slider.value = t;
    for (const told of this.moved) told(this, index);
  }

  // Shows a channel that is not there yet, in place of the last one that was brought.
  bring(name) {
    if (this.shown.has(name) || !this.data.channels.some(c => c.name === name)) return;
    if (this.brought) this.shown.delete(this.brought);
    this.shown.add(this.brought = name);
    this.boxes();
    this.draw();
  }

  impact(step) {
    const all = this.data.contacts.flat(), starts = [...new Set(all.map(k => k[1]))].sort((a, b) => a - b);
    const now = this.jumped ?? this.data.t[this.index];
    const next = step > 0 ? starts.find(t => t > now + 1e-6) : starts.findLast(t => t < now - 1e-6);
    if (next === undefined) return;
    const [corner, start, length] = all.find(k => k[1] === next), [name, place] = this.data.places[corner];
    this.bring(name);
    // The plots get their heights in a microtask.
    requestAnimationFrame(() => this.figures.get(name)?.scrollIntoView({block: "nearest"}));
    const half = 0.004 * (this.data.period || this.whole[1] - this.whole[0]), reach = Math.min(half, 2 * length);
    this.zoom(next - reach, next + length / 2 + reach);
    this.note = {index: this.near(next), text: `Impact at ${place}: ${start.toFixed(6)} s, lasts ${quantity(length, "s")}, ${this.peaks(corner, start, length)}`};
    this.go(this.note.index);
    this.jumped = next;
  }

  // Peak of each model's contact that touches nearest to an instant, within its length.
  peaks(corner, start, length) {
    const nearest = this.data.contacts.map(list => list.filter(k => k[0] === corner && Math.abs(k[1] - start) < length)
      .reduce((best, k) => best && Math.abs(best[1] - start) <= Math.abs(k[1] - start) ? best : k, null));
    return `peak ${nearest.map((k, side) => `${k ? quantity(k[3], "N") : "none"} (${this.data.labels[side]})`).join(", ")}`;
  }

  outside() {
    const all = this.data.channels.filter(c => c.outside.length).map(c => [c.outside[0], c.name]);
    if (!all.length) { this.readout.textContent = `No sample is beyond ${this.data.threshold}.`; return; }
    const [index, name] = all.reduce((a, b) => b[0] < a[0] ? b : a);
    this.bring(name);
    const half = 0.02 * (this.data.period || this.whole[1] - this.whole[0]);
    this.zoom(this.data.t[index] - half, this.data.t[index] + half);
    this.go(index);
  }

  running(on) {
    this.play.textContent = on ? "■ stop" : "▶ play";
    this.play.setAttribute("aria-pressed", on);
  }

  // Runs forward from the cursor to the end of the run; an enlarged range moves along.
  toggle() {
    if (this.timer) {
      clearInterval(this.timer);
      this.timer = null;
      this.running(false);
      return;
    }
    const last = this.data.t.length - 1;
    if (this.index >= last) this.go(0);
    this.clock = this.data.t[this.index];
    this.jumped = undefined;
    let before = performance.now();
    this.timer = setInterval(() => {
      const t = this.data.t, now = performance.now(), least = t[Math.min(this.index + 1, last)] - t[this.index];
      const rate = this.speed || Math.max((this.range[1] - this.range[0]) / 10, 25 * least);
      this.clock += rate * Math.min(now - before, 200) / 1000;
      before = now;
      this.go(this.near(this.clock), true);
      if (this.clock >= this.whole[1]) this.toggle();
    }, 40);
    this.running(true);
  }

  pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const pan = share => { const d = share * (this.range[1] - this.range[0]); this.zoom(this.range[0] + d, this.range[1] + d); };
    const way = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    const actions = {
      "+": () => this.scale(0.5), "=": () => this.scale(0.5), "-": () => this.scale(2), "0": () => this.zoom(...this.whole),
      n: () => this.impact(1), p: () => this.impact(-1), o: () => this.outside(), " ": () => this.toggle(),
    };
    if (way) { if (event.shiftKey) pan(way / 4); else this.go(this.index + way); }
    else if (actions[event.key]) actions[event.key]();
    else return;
    if (event.key !== "n" && event.key !== "p") this.jumped = undefined;
    event.preventDefault();
  }
}

// ---- the page

const viewers = new Map();
let renaming;

// Shows the plots of a scene, as a link wants them where there is one.
async function show(root, wanted) {
  let viewer = viewers.get(root);
  if (viewer && !wanted) return;
  if (!viewer) {
    viewers.set(root, viewer = new Viewer(root));
    animate(viewer);
  }
  const {tier, names, range} = wanted || {};
  if (names) viewer.shown = new Set(names);
  if (range) viewer.range = range;
  await viewer.open(viewer.blocks.has(tier) ? tier : viewer.tier ?? root.dataset.first);
  if (wanted) viewer.zoom(...(range || viewer.whole));
}

function start() {
  // Without what the plots need, the page keeps its drawings.
  if (typeof DecompressionStream !== "function") return;
  document.documentElement.classList.add("interactive");
  const seen = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); show(entry.target); }
  }, {rootMargin: "400px"});
  for (const root of document.querySelectorAll(".viewer")) seen.observe(root);
  const redraw = changed => { for (const v of viewers.values()) if (v.data && v.area.clientWidth && changed(v)) v.draw(); };
  let wait;
  addEventListener("resize", () => {
    clearTimeout(wait);
    wait = setTimeout(() => redraw(v => v.area.clientWidth !== v.width), 150);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw(() => true));
}

// Opens what the address names: an element, or tier, channels and range of plots, as #wedge/tight/slider_x/0.012-0.014.
async function reveal() {
  const [name, ...view] = location.hash.slice(1).split("/"), interactive = document.documentElement.className === "interactive";
  const plots = interactive && view.length && document.getElementById(`${name}--plots`), target = plots || document.getElementById(name);
  if (!target) return;
  for (let closed = target; closed; closed = closed.parentElement.closest("details")) if (closed.tagName === "DETAILS") closed.open = true;
  if (interactive && view.length && target.className === "viewer") {
    const [tier, names, range] = view, ends = /^(-?\d*\.?\d+)-(-?\d*\.?\d+)$/.exec(range);
    await show(target, {tier, names: names?.split(",").map(decoded), range: ends?.slice(1).map(Number)});
  }
  target.scrollIntoView();
}

function decoded(text) {
  try { return decodeURIComponent(text); } catch { return text; }
}

addEventListener("hashchange", reveal);
// Collapsed sections are opened for printing where style sheets cannot do it.
addEventListener("beforeprint", () => document.querySelectorAll("details.scene:not([open])").forEach(d => { d.open = true; d.dataset.closed = ""; }));
addEventListener("afterprint", () => document.querySelectorAll("[data-closed]").forEach(d => { d.open = false; delete d.dataset.closed; }));
start();
reveal();
