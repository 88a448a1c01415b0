// What the live pages share: colours of the style sheet, charts on a canvas, times in words.
"use strict";

const byId = (id) => document.getElementById(id);

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

const channelColours = {R: "r", G: "g", B: "b"};
function channelColour(channel) {
  return colour(channelColours[channel] || "accent");
}

function say(id, text) {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
}

function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return whole + " s";
  if (whole < 3600) return Math.floor(whole / 60) + " min " + (whole % 60) + " s";
  return Math.floor(whole / 3600) + " h " + Math.floor((whole % 3600) / 60) + " min";
}

// Sizes the canvas to its place and the screen's pixels; gives a context in CSS pixels.
function prepared(canvas) {
  const width = canvas.clientWidth;
  const height = Math.round(width / Number(canvas.dataset.ratio));
  const scale = window.devicePixelRatio || 1;
  canvas.style.height = height + "px";
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const context = canvas.getContext("2d");
  context.scale(scale, scale);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  context.lineJoin = "round";
  return {context, width, height};
}

function drawHistogram(canvas, figures) {
  const {context, width, height} = prepared(canvas);
  const floor = height - 16;
  const most = Math.max(...figures.histogram, 1);
  const step = width / figures.histogram.length;
  figures.histogram.forEach((count, bin) => {
    if (count === 0) return;
    const tall = Math.max(1, floor * Math.log1p(count) / Math.log1p(most));
    const last = bin === figures.histogram.length - 1 && figures.saturated_share > 0;
    context.fillStyle = last ? colour("bad") : colour("accent");
    context.fillRect(bin * step, floor - tall, Math.max(1, step - 1), tall);
  });
  context.fillStyle = colour("quiet");
  context.fillText("0 DN", 0, height - 3);
  context.textAlign = "right";
  context.fillText("saturation", width, height - 3);
}

// An axis with few, round labels. values: {x, y, colour, cross} dots or {line: [[x, y]..], colour}.
function drawChart(canvas, chart) {
  const {context, width, height} = prepared(canvas);
  const box = {left: 62, right: width - 8, top: 8, bottom: height - 24};
  const onY = chart.logarithmic ? Math.log10 : (y) => y;
  const [low, high] = [onY(chart.low), onY(chart.high)];
  const x = (v) => box.left + (box.right - box.left) * (v - chart.from) / (chart.to - chart.from || 1);
  const y = (v) => box.bottom - (box.bottom - box.top) * (onY(v) - low) / (high - low || 1);
  context.strokeStyle = colour("grid");
  context.fillStyle = colour("quiet");
  context.textAlign = "right";
  for (const [value, label] of chart.ticks) {
    context.beginPath();
    context.moveTo(box.left, y(value));
    context.lineTo(box.right, y(value));
    context.stroke();
    context.fillText(label, box.left - 6, y(value) + 4);
  }
  context.textAlign = "left";
  context.fillText(chart.fromLabel, box.left, height - 6);
  context.textAlign = "right";
  context.fillText(chart.toLabel, box.right, height - 6);
  for (const series of chart.lines || []) {
    context.strokeStyle = series.colour;
    context.lineWidth = 1.6;
    context.beginPath();
    series.points.forEach(([px, py], i) => i ? context.lineTo(x(px), y(py)) : context.moveTo(x(px), y(py)));
    context.stroke();
  }
  for (const dot of chart.dots || []) {
    context.fillStyle = dot.colour;
    context.beginPath();
    context.arc(x(dot.x), y(dot.y), 3, 0, 2 * Math.PI);
    context.fill();
  }
  context.textAlign = "center";
  for (const cross of chart.crosses || []) {
    context.fillStyle = colour("bad");
    context.fillText("✕", x(cross), box.bottom - 2);
  }
}

// The view from which the rig is drawn; turned by dragging.
const view = {yaw: -0.9, pitch: 0.45};

function drawPose(canvas, pose) {
  const {context, width, height} = prepared(canvas);
  const away = (v) => Math.hypot(v[0], v[1], v[2]);
  const reach = Math.max(away(pose.camera.origin_mm), away(pose.lamp.origin_mm), 1);
  const scale = 0.48 * Math.min(width, 1.2 * height) / reach;
  const [cy, sy, cp, sp] = [Math.cos(view.yaw), Math.sin(view.yaw), Math.cos(view.pitch), Math.sin(view.pitch)];
  const flat = ([px, py, pz]) => {
    const right = cy * px + sy * py;
    const deep = -sy * px + cy * py;
    return [width / 2 + scale * right, height / 2 + scale * (sp * deep - cp * pz)];
  };
  const at = (tip, a, b, c) => tip.origin_mm.map((o, i) => o + a * tip.x[i] + b * tip.y[i] + c * tip.z[i]);
  const path = (points, close) => {
    context.beginPath();
    points.forEach((point, i) => i ? context.lineTo(...flat(point)) : context.moveTo(...flat(point)));
    if (close) context.closePath();
  };
  const circle = [...Array(61).keys()].map((i) => 2 * Math.PI * i / 60);
  // The plane of the vertical axis' turns, for orientation.
  context.strokeStyle = colour("grid");
  context.lineWidth = 1;
  path(circle.map((t) => [reach * Math.cos(t), reach * Math.sin(t), 0]), true);
  context.stroke();
  context.setLineDash([3, 4]);
  path([[0, 0, -0.35 * reach], [0, 0, 0.6 * reach]]);
  context.stroke();
  // Light to the sample, and on to the camera.
  context.lineWidth = 1.5;
  context.strokeStyle = colour("light");
  path([pose.lamp.origin_mm, pose.sample.origin_mm]);
  context.stroke();
  context.strokeStyle = colour("detector");
  path([pose.sample.origin_mm, pose.camera.origin_mm]);
  context.stroke();
  context.setLineDash([]);
  const half = 0.22 * reach;
  const plate = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
  path(plate.map(([a, b]) => at(pose.sample, a * half, b * half, 0)), true);
  context.fillStyle = colour("accent-soft");
  context.fill();
  context.strokeStyle = colour("ink");
  context.stroke();
  path([pose.sample.origin_mm, at(pose.sample, 0, 0, 1.5 * half)]);
  context.stroke();
  const tip = flat(at(pose.sample, 0, 0, 1.5 * half));
  context.fillStyle = colour("ink");
  context.beginPath();
  context.arc(...tip, 3, 0, 2 * Math.PI);
  context.fill();
  // The sample's mark, its x.
  path([at(pose.sample, half, 0, 0), at(pose.sample, 1.25 * half, 0, 0)]);
  context.stroke();
  const size = 0.12 * reach;
  context.strokeStyle = colour("detector");
  const front = plate.map(([a, b]) => at(pose.camera, a * size, 0.75 * b * size, 1.6 * size));
  path(front, true);
  context.stroke();
  for (const corner of front) {
    path([pose.camera.origin_mm, corner]);
    context.stroke();
  }
  context.strokeStyle = colour("light");
  const rim = circle.map((t) => at(pose.lamp, size * Math.cos(t), size * Math.sin(t), 1.2 * size));
  path(rim, true);
  context.stroke();
  for (let i = 0; i < 60; i += 15) {
    path([pose.lamp.origin_mm, rim[i]]);
    context.stroke();
  }
}

function turnByDragging(canvas, redraw) {
  let last = null;
  canvas.addEventListener("pointerdown", (event) => {
    last = event;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    view.yaw -= (event.clientX - last.clientX) * 0.01;
    view.pitch = Math.min(1.5, Math.max(-1.5, view.pitch + (event.clientY - last.clientY) * 0.01));
    last = event;
    redraw();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
}

async function getJson(path) {
  const reply = await fetch(path, {cache: "no-store"});
  if (!reply.ok) throw new Error(path + ": " + reply.status);
  return reply.json();
}

// The token stands behind the '#' of the address that the program has printed; it is never part of
// a request's address.
const token = location.hash.slice(1);

async function post(path) {
  const reply = await fetch(path, {method: "POST", headers: {"X-Gonio-Token": token}});
  if (!reply.ok) throw new Error((await reply.text()).trim());
}

// Calls `update` at most once per period, never while the last call is under way.
function poll(update, period_ms, onFailure) {
  const again = async () => {
    try {
      await update();
    } catch (error) {
      onFailure(error);
    }
    setTimeout(again, period_ms);
  };
  again();
}
