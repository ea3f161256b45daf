"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);
const set = (element, values) => { for (const name in values) element.setAttribute(name, values[name]); };
const frames = data.time.length, last = data.time[frames - 1], first = data.time[0];
const ends = { crank: "OA", rod2: "AB", rocker: "HC", rod4: "CF" };
const inward = [1, -1, -1, 1]; // the force of a wall on the corners ll, lr, ur, ul
let shown = 0, playing = false, began = 0, from = 0;

function show(frame) {
  shown = Math.max(0, Math.min(frames - 1, frame));
  const at = {};
  for (const name of "OABHCF") at[name] = data.links[name][shown];
  for (const id in ends) {
    const [a, b] = [...ends[id]].map((name) => at[name]);
    set(by(id), { x1: a[0], y1: a[1], x2: b[0], y2: b[1] });
  }
  for (const name in at) set(by("at" + name), { cx: at[name][0], cy: at[name][1] });
  set(by("block"), { x: at.F[0] - data.block[0] / 2, y: at.F[1] - data.block[1] / 2 });
  data.sliders.forEach((corners, model) => {
    set(by("slider" + model), { points: corners[shown].map((p) => p.join(",")).join(" ") });
    corners[shown].forEach(([x, y], corner) => {
      const size = data.forces[model][corner][shown];
      set(by("force" + model + corner), { x1: x, x2: x + inward[corner] * size, y1: y, y2: y,
        visibility: size > 0 ? "visible" : "hidden" });
    });
  });
  const x = 60 + (790 * (data.time[shown] - first)) / (last - first);
  set(by("cursor"), { x1: x, x2: x });
  by("frame").value = shown;
  by("now").textContent = `${data.time[shown].toFixed(4)} s, crank cycle ${data.cycle[shown].toFixed(3)}`;
}

function frameAt(time) {
  let low = 0, high = frames - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (data.time[middle] <= time) low = middle; else high = middle;
  }
  return time - data.time[low] < data.time[high] - time ? low : high;
}

function tick(now) {
  if (!playing) return;
  const time = from + (now - began) / 1000 / by("speed").value;
  if (time >= last) { show(frames - 1); play(false); return; }
  show(frameAt(time));
  requestAnimationFrame(tick);
}

function play(on) {
  playing = on;
  by("play").textContent = on ? "Pause" : "Play";
  set(by("play"), { "aria-pressed": on });
  if (!on) return;
  if (shown === frames - 1) show(0);
  [began, from] = [performance.now(), data.time[shown]];
  requestAnimationFrame(tick);
}

function seek(frame) { play(false); show(frame); }

by("play").addEventListener("click", () => play(!playing));
by("speed").addEventListener("change", () => { if (playing) play(true); });
by("frame").addEventListener("input", (event) => seek(Number(event.target.value)));
by("plot").addEventListener("click", (event) => {
  const box = by("plot").getBoundingClientRect();
  const share = ((event.clientX - box.left) / box.width * 860 - 60) / 790;
  seek(frameAt(first + share * (last - first)));
});
document.addEventListener("keydown", (event) => {
  if (event.target.closest("button, select, input")) return;
  if (event.key === " ") { event.preventDefault(); play(!playing); }
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (step) seek(shown + step);
});
show(0);
