// The page for focusing and aiming: the newest frame, a crosshair, a region and how sharp it is.
"use strict";

const kHistory = 200;
let state = null;
let region = null;  // in frame pixels; null: the whole frame
let drawn = null;   // while dragging
let history = [];

function query() {
  if (!region) return "";
  return "?column=" + region.column + "&row=" + region.row + "&width=" + region.width + "&height=" + region.height;
}

function drawOverlay() {
  const canvas = byId("overlay");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const context = canvas.getContext("2d");
  context.scale(scale, scale);
  context.strokeStyle = "rgba(90,220,240,.85)";
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(width / 2, 0);
  context.lineTo(width / 2, height);
  context.moveTo(0, height / 2);
  context.lineTo(width, height / 2);
  context.stroke();
  context.beginPath();
  context.arc(width / 2, height / 2, 0.08 * width, 0, 2 * Math.PI);
  context.stroke();
  const shown = drawn || region;
  if (!shown || !state || !state.width_px) return;
  const perPixel = width / state.width_px;
  context.strokeStyle = "#ffd24a";
  context.lineWidth = 2;
  context.strokeRect(shown.column * perPixel, shown.row * perPixel, shown.width * perPixel, shown.height * perPixel);
}

function short(value) {
  return value === 0 ? "0" : value >= 0.01 && value < 1000 ? value.toPrecision(3) : value.toExponential(2);
}

function draw() {
  if (!state) return;
  say("title", state.title);
  say("says", state.error || (state.number === 0 ? "waits for the first frame" :
    "frame " + state.number + ", " + state.width_px + " × " + state.height_px + " px, " +
    Number(state.exposure_ms.toPrecision(3)) + " ms"));
  drawOverlay();
  if (state.number === 0) return;
  say("focus", state.focus > 0 ? short(state.focus) : "too dark");
  const best = Math.max(...history, 0);
  say("best", short(best));
  const top = best > 0 ? 1.1 * best : 1;
  drawChart(byId("history"), {low: 0, high: top, ticks: [[0, "0"], [best, short(best)]], from: 0, to: kHistory,
    fromLabel: "", toLabel: "now",
    lines: [{colour: colour("accent"), points: history.map((v, i) => [kHistory - history.length + 1 + i, v])}]});
  drawHistogram(byId("histogram"), state.figures);
  const r = state.region_px;
  say("region-says", r.width + " × " + r.height + " px at " + r.column + ", " + r.row + ": mean " +
    state.figures.mean_dn.toFixed(0) + ", " + state.figures.min_dn + " to " + state.figures.max_dn + " DN, " +
    (100 * state.figures.saturated_share).toPrecision(2) + " % saturated");
}

async function update() {
  const last = state ? state.number : 0;
  state = await getJson("/setup.json" + query());
  if (state.number !== last) {
    byId("frame").src = "/frame.png?n=" + state.number;
    history.push(state.focus);
    if (history.length > kHistory) history.shift();
  }
  draw();
}

function pixelAt(event) {
  const box = byId("finder").getBoundingClientRect();
  const perPixel = box.width / state.width_px;
  const inside = (v, most) => Math.round(Math.min(Math.max(v, 0), most));
  return [inside((event.clientX - box.left) / perPixel, state.width_px),
    inside((event.clientY - box.top) / perPixel, state.height_px)];
}

let from = null;
byId("finder").addEventListener("pointerdown", (event) => {
  if (!state || !state.width_px) return;
  event.preventDefault();
  from = pixelAt(event);
  byId("finder").setPointerCapture(event.pointerId);
});
byId("finder").addEventListener("pointermove", (event) => {
  if (!from) return;
  const to = pixelAt(event);
  drawn = {column: Math.min(from[0], to[0]), row: Math.min(from[1], to[1]),
    width: Math.abs(to[0] - from[0]), height: Math.abs(to[1] - from[1])};
  drawOverlay();
});
byId("finder").addEventListener("pointerup", () => {
  if (!from) return;
  region = drawn && drawn.width > 3 && drawn.height > 3 ? drawn : null;
  from = drawn = null;
  history = [];
  drawOverlay();
});
byId("again").addEventListener("click", () => { history = []; draw(); });
byId("frame").addEventListener("load", drawOverlay);
window.addEventListener("resize", draw);
poll(update, 300, () => say("says", "no answer: the program has ended or cannot be reached"));
