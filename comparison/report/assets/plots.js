// Interactive plots of a scene: both models above, their difference and its threshold below, one cursor for all.
"use strict";

const CORNERS = ["ll", "lr", "ul", "ur", "pin"];
const PLACES = ["lower left", "lower right", "upper left", "upper right", "crank pin"];
const DIFFERENCE = "difference", RATIO = "ratio";

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in made) made[key] = value; else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

// Digits that a reader can use: 3 significant ones, with an SI prefix from milli to nano where the unit takes one.
function quantity(value, unit) {
  if (value === null || value === undefined || Number.isNaN(value)) return "n/a";
  const size = Math.abs(value);
  const prefixes = unit && !/^(deg|%|1)/.test(unit) ? [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]] : [[1, ""]];
  const [factor, letter] = prefixes.find(([least]) => size >= least * 0.9995) || prefixes[0];
  const text = size && size < 0.001 * factor ? (value / factor).toExponential(2) : String(+(value / factor).toPrecision(4));
  return `${text} ${letter}${unit}`.trim();
}

// ---- data

async function inflate(text) {
  const packed = Uint8Array.from(atob(text.trim()), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function unpack(bytes) {
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const n = head.samples;
  let at = 4 + length;
  // The bytes of all samples stand plane by plane, the lowest first; `size` of `width` are stored.
  const planes = (width, size) => {
    const out = new Uint8Array(n * width);
    for (let k = 0; k < size; k++) {
      for (let i = 0; i < n; i++) out[i * width + width - size + k] = bytes[at + k * n + i];
    }
    at += size * n;
    return out.buffer;
  };
  const [start, end] = head.time;
  head.t = head.uneven ? Float64Array.from(new Float64Array(planes(8, 8)), t => start + t)
    : Float64Array.from({length: n}, (_, i) => start + (end - start) * i / (n - 1));
  for (const c of head.channels) {
    const a = new Float32Array(planes(4, 4));
    const e = new Float32Array(planes(4, 2)), limit = new Float32Array(planes(4, 2));
    const shift = c.offset - c.zero;
    c.a = Array.from(a, v => v + shift);
    c.b = c.a.map((v, i) => v - e[i]);
    c.size = Array.from(e, v => Math.abs(v) || null);
    c.known = Boolean(c.threshold);
    c.within = Array.from(limit, v => Math.abs(v));
    c.judged = Array.from(limit, v => !(v < 0 || Object.is(v, -0)));
    c.ratio = c.size.map((v, i) => c.judged[i] && c.within[i] ? (v || 0) / c.within[i] || null : null);
  }
  // Contacts resolved at a model's own steps: times and forces as shares of the last and of the largest.
  const shares = count => {
    const out = Array.from({length: count}, (_, i) => (bytes[at + i] + 256 * bytes[at + count + i]) / 65535);
    at += 2 * count;
    return out;
  };
  head.pulses = head.pulses.map((model, side) => {
    const count = model.count.reduce((a, b) => a + b, 0), times = shares(count), forces = shares(count);
    let from = 0;
    return model.of.map((place, i) => {
      const contact = head.contacts[side][place], part = [from, from += model.count[i]];
      return {
        corner: contact[0], start: contact[1], end: contact[1] + model.last[i], most: model.peak[i],
        t: times.slice(...part).map(v => contact[1] + v * model.last[i]), n: forces.slice(...part).map(v => v * model.peak[i]),
      };
    });
  });
  return head;
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

const cornerOf = c => CORNERS.findIndex(name => c.name === `corner_${name}_normal`);

// Peaks of the event table: contacts are shorter than samples are apart, so curves alone miss most of them.
function peaks(viewer, c) {
  const corner = cornerOf(c);
  if (corner < 0) return [[], []];
  return viewer.data.contacts.map((list, side) => {
    // At the largest force of a resolved contact, in the middle of another.
    const at = new Map(viewer.data.pulses[side].map(p => [p.start, p.t[p.n.indexOf(Math.max(...p.n))]]));
    return list.filter(k => k[0] === corner).map(k => [at.get(k[1]) ?? k[1] + k[2] / 2, k[3]]);
  });
}

// Width and colour of either model's curve: a thin line on a wide, pale one shows both where they coincide.
const STYLES = [{name: "first", alpha: "99", width: 4}, {name: "second", alpha: "", width: 1.5}];
const stroke = side => colour(STYLES[side].name) + STYLES[side].alpha;

function drawPulses(u, pulses) {
  const {ctx, bbox} = u, {min, max} = u.scales.x;
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
      p.t.forEach((t, i) => ctx.lineTo(u.valToPos(t, "x", true), u.valToPos(p.n[i], "y", true)));
      ctx.stroke();
    }
  });
  ctx.restore();
}

function drawPeaks(u, marks) {
  const {ctx} = u, r = 3 * devicePixelRatio;
  marks.forEach((list, side) => {
    ctx.fillStyle = colour(side ? "second" : "first");
    for (const [t, value] of list) {
      if (t < u.scales.x.min || t > u.scales.x.max) continue;
      const x = u.valToPos(t, "x", true), y = u.valToPos(value, "y", true), up = side ? -1 : 1;
      ctx.beginPath();
      ctx.moveTo(x, y);
      ctx.lineTo(x - r, y + up * 2 * r);
      ctx.lineTo(x + r, y + up * 2 * r);
      ctx.fill();
    }
  });
}

// Decimals that tell neighbouring ticks apart.
function decimals(splits, factor) {
  const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) / factor : 1;
  for (let n = 0; n < 12; n++) if (Math.abs(step * 10 ** n - Math.round(step * 10 ** n)) < 1e-6 * step * 10 ** n) return n;
  return 12;
}

function options(viewer, width, height, extra) {
  const axis = {stroke: colour("ink"), grid: {stroke: colour("grid"), width: 1}, ticks: {stroke: colour("line"), width: 1}, font: "12px system-ui, sans-serif"};
  return {
    width, height, legend: {show: false},
    cursor: {sync: {key: viewer.key, scales: ["x", null]}, drag: {x: true, y: false, setScale: false}, points: {size: 6}},
    scales: {x: {time: false, min: viewer.range[0], max: viewer.range[1]}, ...extra.scales},
    axes: [
      {...axis, space: 90, values: (u, splits) => splits.map(v => v.toFixed(decimals(splits, 1))), size: extra.last ? 40 : 24, label: extra.last ? "time (s)" : undefined, labelSize: 18},
      {...axis, size: 66, label: extra.label, labelSize: 18, labelFont: "12px system-ui, sans-serif", ...extra.axis},
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
  const marks = peaks(viewer, c), corner = cornerOf(c);
  const pulses = viewer.data.pulses.map(list => list.filter(p => p.corner === corner));
  // Between samples far apart a line would be drawn through the middle of contacts that are known.
  const lines = uPlot.paths.linear();
  const paths = (u, ...rest) => pulses.flat().length && dense(u) ? null : lines(u, ...rest);
  const span = (u, low, high) => {
    // The plot has its new range only after this; what reaches into it counts with its peak.
    const [start, end] = viewer.range;
    for (const [t, value] of marks.flat()) if (t >= start && t <= end) high = Math.max(high, value);
    for (const p of pulses.flat()) if (p.end >= start && p.start <= end) high = Math.max(high, p.most);
    if (!(high > low)) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
    const margin = 0.06 * (high - low);
    return [low - margin, high + margin];
  };
  // Written in full these axes would need ten digits once they are enlarged.
  const values = (u, splits) => {
    const most = Math.max(...splits.map(Math.abs));
    const [factor, letter] = !c.unit || /^(deg|%|1)/.test(c.unit) ? [1, ""]
      : [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]].find(([least]) => most >= least * 0.9995) || [1, ""];
    const digits = decimals(splits, factor);
    return splits.map((v, i) => (v / factor).toFixed(digits) + (i === splits.length - 1 && letter + c.unit ? ` ${letter}${c.unit}` : ""));
  };
  const name = c.zero ? "x − guide" : c.label.split(",")[0];
  return [options(viewer, width, 190, {
    label: name, judged: c.judged, scales: {y: {range: span}}, axis: {values, size: 84},
    series: [
      ...STYLES.map(({width}, side) => ({label: viewer.data.labels[side], stroke: stroke(side), width, paths, points: {show: u => dense(u)}})),
    ],
    draw: u => { drawPulses(u, pulses); drawPeaks(u, marks); },
  }), [viewer.data.t, c.a, c.b]];
}

const dense = u => u.data[0].length * 6 < u.bbox.width * u.data[0].length / Math.max(1, u.series[0].idxs[1] - u.series[0].idxs[0]);

function differencePlot(viewer, c, width) {
  const log = (lows, highs) => (u, low, high) => {
    high = Math.max(high || lows, highs);
    low = Math.max(Math.min(low || high / 1e3, high / 1e3), high * 1e-16);
    return [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high))];
  };
  const splits = (u, axis, low, high) => {
    const first = Math.round(Math.log10(low)), last = Math.round(Math.log10(high)), step = Math.ceil((last - first) / 5) || 1;
    return Array.from({length: Math.floor((last - first) / step) + 1}, (_, i) => 10 ** (first + i * step));
  };
  const values = (u, splits) => splits.map(v => "10" + String(Math.round(Math.log10(v))).replace(/[-\d]/g, d => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(d)]));
  const ratio = viewer.view === RATIO && c.known;
  const line = {label: "difference", stroke: colour("difference"), width: 1.2, points: {show: u => dense(u)}};
  const limit = {label: "threshold", stroke: colour(ratio ? "outside" : "threshold"), width: 1.2, dash: [8, 3, 2, 3], points: {show: false}};
  const outside = {label: "outside", stroke: colour("outside"), width: 0, paths: () => null, points: {show: true, size: 6, fill: colour("outside")}};
  const over = c.size.map((v, i) => c.known && c.judged[i] && v > c.within[i] ? (ratio ? c.ratio[i] : v) : null);
  const data = ratio ? [viewer.data.t, c.ratio, c.t1 || (c.t1 = c.ratio.map(() => 1)), over]
    : [viewer.data.t, c.size, c.known ? c.within : c.size.map(() => null), over];
  return [options(viewer, width, 170, {
    label: ratio ? `|difference| / ${c.threshold}` : `|difference| (${c.unit || "1"})`, judged: c.judged, last: true,
    scales: {y: {distr: 3, range: log(1, ratio ? 2 : 0)}}, axis: {values, splits, filter: (u, splits) => splits, size: 84}, series: [line, limit, outside],
  }), data];
}

// ---- the viewer

class Viewer {
  constructor(root) {
    this.root = root;
    this.key = root.id;
    this.blocks = new Map([...root.querySelectorAll("script[data-tier]")].map(s => [s.dataset.tier, s]));
    this.tiers = new Map();
    this.plots = [];
    this.view = DIFFERENCE;
    this.index = 0;
    this.moved = [];
  }

  async open(tier) {
    if (!this.tiers.has(tier)) this.tiers.set(tier, unpack(await inflate(this.blocks.get(tier).textContent)));
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

  controls() {
    const button = (text, label, action) => element("button", {type: "button", ariaLabel: label, title: label, onclick: action}, text);
    const chip = (type, name, text, checked, action, title = "") => element("label", {className: "chip", title},
      element("input", {type, name, checked, onchange: action}), text);
    const bar = element("div", {className: "bar"});
    if (this.blocks.size > 1) {
      bar.append(element("fieldset", {}, element("legend", {}, "Tier"), ...[...this.blocks.keys()].map(tier =>
        chip("radio", `${this.key}-tier`, tier, tier === this.tier, () => this.open(tier)))));
    }
    bar.append(element("fieldset", {}, element("legend", {}, "Lower plots"),
      chip("radio", `${this.key}-view`, "|E| and threshold", this.view === DIFFERENCE, () => { this.view = DIFFERENCE; this.draw(); }),
      chip("radio", `${this.key}-view`, "|E| / 2u", this.view === RATIO, () => { this.view = RATIO; this.draw(); })));
    const jumps = element("fieldset", {}, element("legend", {}, "Go to"),
      button("◂ impact", "Previous impact (p)", () => this.impact(-1)), button("impact ▸", "Next impact (n)", () => this.impact(1)),
      button("first outside", "First sample outside its threshold (o)", () => this.outside()),
      button("+", "Enlarge (+)", () => this.scale(0.5)), button("−", "Reduce (−)", () => this.scale(2)),
      button("whole run", "Whole run (0)", () => this.zoom(...this.whole)));
    this.play = button("▶ play", "Play or stop the motion (space)", () => this.toggle());
    jumps.append(this.play);
    bar.append(jumps);
    const marks = {agree: "✓", differ: "✗", indeterminate: "?"};
    const picker = element("details", {className: "picker", open: innerWidth > 700}, element("summary", {}, "Channels"), ...this.data.channels.map(c =>
      chip("checkbox", c.name, `${marks[c.verdict] || "!"} ${c.name}`, this.shown.has(c.name), event => {
        if (event.target.checked) this.shown.add(c.name); else this.shown.delete(c.name);
        this.draw();
      }, `${c.label}: ${c.verdict}`)));
    this.boxes = () => { for (const box of picker.querySelectorAll("input")) box.checked = this.shown.has(box.name); };
    this.readout = element("p", {className: "readout", role: "status", "aria-live": "off"});
    this.area = element("div", {className: "plots", tabIndex: 0, role: "group",
      ariaLabel: "Plots. Keys: left and right move the cursor, with shift they pan; plus, minus and 0 zoom; n and p go to the next and previous impact, o to the first sample outside; space plays."});
    this.area.addEventListener("keydown", event => this.pressed(event));
    this.area.addEventListener("wheel", event => {
      // Without focus the wheel scrolls the page, as everywhere else.
      if (!event.ctrlKey && !this.area.contains(document.activeElement)) return;
      event.preventDefault();
      const over = this.plots[0]?.over.getBoundingClientRect();
      if (over) this.scale(event.deltaY < 0 ? 0.8 : 1.25, this.range[0] + (event.clientX - over.left) / over.width * (this.range[1] - this.range[0]));
    }, {passive: false});
    this.area.addEventListener("pointerdown", () => this.area.focus({preventScroll: true}));
    const some = this.data.samples < this.data.of ? ` Of ${this.data.of} samples ${this.data.samples} are kept, with all envelopes.` : "";
    const help = element("p", {className: "soft"}, "Drag to enlarge; click, then the wheel enlarges too (or Ctrl and wheel). Keys: ← → cursor, Shift ← → pan, + − 0 zoom, n p impacts, o first outside, space play. Shaded: not predictable. Triangles: peaks of the event tables." + this.resolved() + some);
    this.root.querySelector(".mount").replaceChildren(bar, picker, this.readout, this.area, help);
  }

  // What is known of forces between samples.
  resolved() {
    const {contacts, pulses, labels} = this.data;
    if (!pulses.flat().length) return "";
    const counts = labels.map((label, side) => `${pulses[side].length} of ${contacts[side].length} of ${label}`);
    return ` Contacts drawn at the models' own steps between samples: ${counts.join(", ")}; of the others the peak alone.`;
  }

  draw() {
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
    this.figures = new Map();
    this.area.replaceChildren();
    this.width = this.area.clientWidth;
    for (const c of this.data.channels.filter(c => this.shown.has(c.name))) {
      const legend = element("p", {className: "legend"}, element("b", {}, c.label), " ",
        element("span", {className: "key first"}, this.data.labels[0]), " ", element("span", {className: "key second"}, this.data.labels[1]));
      const boxes = [element("div"), element("div")];
      const figure = element("figure", {ariaLabel: `${c.label} over time, both models, and their difference. Verdict ${c.verdict}.`}, legend, ...boxes);
      this.figures.set(c.name, figure);
      this.area.append(figure);
      for (const [n, made] of [modelsPlot(this, c, this.width), differencePlot(this, c, this.width)].entries()) {
        this.plots.push(new uPlot(...made, boxes[n]));
      }
    }
    this.at(this.index);
  }

  zoom(low, high) {
    const [first, last] = this.whole, least = 1e-7;
    let width = Math.min(Math.max(high - low, least), last - first);
    low = Math.min(Math.max(low, first), last - width);
    this.range = [low, low + width];
    for (const plot of this.plots) plot.setScale("x", {min: low, max: low + width});
  }

  scale(factor, about = this.data.t[this.index]) {
    const [low, high] = this.range;
    if (about < low || about > high) about = (low + high) / 2;
    this.zoom(about - (about - low) * factor, about + (high - about) * factor);
  }

  // Puts the cursor of all plots at a sample, brings it into view and tells the drawing.
  go(index) {
    this.index = Math.min(Math.max(index, 0), this.data.t.length - 1);
    const t = this.data.t[this.index], [low, high] = this.range;
    if (t < low || t > high) this.zoom(t - (high - low) / 2, t + (high - low) / 2);
    const wanted = this.index;
    // The plots take a new range over in a microtask; only then is the place of a sample known.
    queueMicrotask(() => {
      for (const plot of this.plots) plot.setCursor({left: plot.valToPos(t, "x"), top: 10}, false);
      this.at(wanted);
    });
  }

  near(time) {
    const t = this.data.t;
    let low = 0, high = t.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] <= time) low = middle; else high = middle; }
    return time - t[low] < t[high] - time ? low : high;
  }

  at(index) {
    this.index = index;
    const t = this.data.t[index], parts = [`t = ${t.toFixed(5)} s`];
    if (this.data.period) parts.push(`cycle ${(t / this.data.period + 1e-9).toFixed(3)}`);
    for (const c of this.data.channels.filter(c => this.shown.has(c.name))) {
      let text = `${c.name}: ${quantity(c.a[index], c.unit)}, ${quantity(c.b[index], c.unit)}; |E| ${quantity(c.size[index] || 0, c.unit)}`;
      if (c.known) text += c.judged[index] ? `, ${(c.ratio[index] || 0).toPrecision(2)} times ${c.threshold}` : ", not predictable";
      parts.push(text);
    }
    if (this.note && this.note.index === index) parts.unshift(this.note.text);
    this.readout.textContent = parts.join("  ·  ");
    this.readout.dataset.time = t;
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
    const starts = [...new Set(this.data.contacts.flat().map(k => k[1]))].sort((a, b) => a - b);
    const now = this.jumped ?? this.data.t[this.index];
    const next = step > 0 ? starts.find(t => t > now + 1e-6) : starts.findLast(t => t < now - 1e-6);
    if (next === undefined) return;
    const [corner, start, length] = this.data.contacts.flat().find(k => k[1] === next);
    const name = `corner_${CORNERS[corner]}_normal`;
    this.bring(name);
    // The plots get their heights in a microtask.
    requestAnimationFrame(() => this.figures.get(name)?.scrollIntoView({block: "nearest"}));
    const half = 0.004 * (this.data.period || this.whole[1] - this.whole[0]), reach = Math.min(half, 2 * length);
    this.zoom(next - reach, next + length / 2 + reach);
    this.note = {index: this.near(next), text: `Impact at the ${PLACES[corner]}: ${start.toFixed(6)} s, lasts ${quantity(length, "s")}, ${this.peaks(corner, start, length)}`};
    this.go(this.note.index);
    this.jumped = next;
  }

  // Peak of each model's contact that touches nearest to an instant, within its length.
  peaks(corner, start, length) {
    const found = this.data.contacts.map(list => list.filter(k => k[0] === corner && Math.abs(k[1] - start) < length)
      .reduce((best, k) => best && Math.abs(best[1] - start) <= Math.abs(k[1] - start) ? best : k, null));
    return `peak ${found.map((k, side) => `${k ? quantity(k[3], "N") : "none"} (${this.data.labels[side]})`).join(", ")}`;
  }

  outside() {
    const all = this.data.channels.filter(c => c.outside.length).map(c => [c.outside[0], c.name]);
    if (!all.length) { this.readout.textContent = "No sample is outside its threshold."; return; }
    const [index, name] = all.reduce((a, b) => b[0] < a[0] ? b : a);
    this.bring(name);
    const half = 0.02 * (this.data.period || this.whole[1] - this.whole[0]);
    this.zoom(this.data.t[index] - half, this.data.t[index] + half);
    this.go(index);
  }

  toggle() {
    clearInterval(this.timer);
    this.timer = this.timer ? null : setInterval(() => {
      const step = Math.max(1, Math.round((this.near(this.range[1]) - this.near(this.range[0])) / 300));
      this.go(this.index + step >= this.near(this.range[1]) ? this.near(this.range[0]) : this.index + step);
    }, 40);
    this.play.textContent = this.timer ? "■ stop" : "▶ play";
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

async function show(root) {
  if (viewers.has(root)) return;
  const viewer = new Viewer(root);
  viewers.set(root, viewer);
  if (typeof animate === "function") animate(viewer);
  await viewer.open(root.dataset.first);
}

function start() {
  // Without what the plots need, the page keeps its drawings.
  if (typeof DecompressionStream !== "function") return;
  document.documentElement.classList.add("interactive");
  const all = [...document.querySelectorAll(".viewer")];
  const seen = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { seen.unobserve(entry.target); show(entry.target); }
  }, {rootMargin: "400px"});
  for (const root of all) seen.observe(root);
  let wait;
  addEventListener("resize", () => {
    clearTimeout(wait);
    wait = setTimeout(() => { for (const v of viewers.values()) if (v.data && v.area.clientWidth && v.area.clientWidth !== v.width) v.draw(); }, 150);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const v of viewers.values()) if (v.data) v.draw(); });
}

function reveal() {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  const closed = target && target.closest("details:not([open])");
  if (!closed) return;
  closed.open = true;
  target.scrollIntoView();
}

addEventListener("hashchange", reveal);
// Collapsed sections are opened for printing where style sheets cannot do it.
addEventListener("beforeprint", () => document.querySelectorAll("details:not([open])").forEach(d => { d.open = true; d.dataset.closed = ""; }));
addEventListener("afterprint", () => document.querySelectorAll("[data-closed]").forEach(d => { d.open = false; delete d.dataset.closed; }));
start();
reveal();
