// The page of a running session: asks /state.json once a second and shows what it says.
"use strict";

const points = [];
let state = null;
let shownFrame = 0;
let shownSphere = 0;
let shownNotes = -1;
let heard = 0;

const phaseClass = {finished: "passed", failed: "failed", stopped: "remark", paused: "remark",
  incomplete: "remark", pausing: "remark", stopping: "remark"};
const alarming = /error|warning|retry|stopped|paused|cut back|resumed|lost|slip|suspect/;

function showPhase(text, kind) {
  say("phase", text);
  byId("phase").className = "verdict " + kind;
}

function showProgress() {
  const under = state.phase === "point" ? "point " + state.point : state.phase;
  showPhase(under || "preparing", phaseClass[state.phase] || "na");
  say("title", state.sample_id || state.archive);
  document.title = (state.points_total ? state.points_done + "/" + state.points_total + " " : "") + "gonio live";
  say("subtitle", state.rig + (state.simulated ? " (simulated)" : "") + " · " + state.archive);
  const whole = state.elapsed_s + state.remaining_s;
  const share = state.is_over && state.phase === "finished" ? 1 : whole > 0 ? state.elapsed_s / whole : 0;
  byId("bar").style.width = (100 * share).toFixed(1) + "%";
  say("points", state.points_done + " of " + state.points_total);
  const scale = state.time_scale;
  say("left", state.is_over ? "over" : scale ? duration(state.remaining_s / scale) : "–");
  say("elapsed", duration(state.elapsed_s));
  say("failed", String(state.not_measured));
  say("frames", String(state.frames));
  const d = state.direction;
  say("direction", d && !state.is_over
    ? [d.theta_h_deg, d.theta_d_deg, d.phi_d_deg].map((v) => v.toFixed(0) + "°").join("\u2002") : "–");
  byId("controls").hidden = token === "" || state.is_over;
  byId("pause").disabled = state.phase === "pausing" || state.phase === "stopping";
  byId("stop").disabled = state.phase === "stopping";
  say("says", token === "" && !state.is_over
    ? "Looking only: the address printed with the token can also pause and stop." : "");
}

function showFrame() {
  const frame = state.frame;
  if (!frame) return;
  if (frame.id !== shownFrame) {
    shownFrame = frame.id;
    byId("frame").src = "/frame.png?n=" + frame.id;
    byId("frame").hidden = false;
  }
  const what = frame.kind === "sample" ? "point " + frame.point : frame.kind.replace("_", " ");
  say("frame-says", what + (frame.channel ? ", " + frame.channel : "") + ", " +
    Number(frame.exposure_ms.toPrecision(3)) + " ms, " + frame.width_px + " × " + frame.height_px + " px" +
    (frame.newest ? "" : "; not the newest, at " + duration(frame.at_s) + " of the whole session"));
  drawHistogram(byId("histogram"), frame.figures);
  const saturated = 100 * frame.figures.saturated_share;
  say("histogram-says", "mean " + frame.figures.mean_dn.toFixed(0) + ", " + frame.figures.min_dn + " to " +
    frame.figures.max_dn + " DN; " +
    (saturated === 0 ? "nothing saturated" : saturated.toPrecision(2) + " % saturated (red)"));
}

function showPose() {
  if (!state || !state.pose) return;
  drawPose(byId("pose"), state.pose);
  const body = byId("joints");
  body.replaceChildren(...state.pose.axes.map((axis) => {
    const row = document.createElement("tr");
    const name = document.createElement("td");
    name.textContent = axis.name;
    const range = document.createElement("td");
    range.className = "range";
    const meter = document.createElement("meter");
    meter.min = axis.min_deg;
    meter.max = axis.max_deg;
    meter.value = axis.at_deg;
    range.append(meter);
    const value = document.createElement("td");
    value.textContent = axis.at_deg.toFixed(3) + "°";
    row.append(name, range, value);
    return row;
  }));
}

function showSamples() {
  const dots = [];
  const crosses = [];
  points.forEach((point, place) => {
    if (point.outcome !== "measured") crosses.push(place + 1);
    for (const [channel, value] of Object.entries(point.signal_over_white)) {
      if (value > 0) dots.push({x: place + 1, y: value, colour: channelColour(channel)});
    }
  });
  const values = dots.map((dot) => dot.y);
  if (points.length > 0 && values.length === 0) {
    say("samples-say", "No quick look: the white does not lie where the points are looked at.");
  }
  const low = values.length ? Math.floor(Math.log10(Math.min(...values))) : -2;
  const high = Math.max(low + 1, values.length ? Math.ceil(Math.log10(Math.max(...values))) : 0);
  const ticks = [];
  for (let e = low; e <= high; ++e) ticks.push([10 ** e, e < -3 || e > 3 ? "1e" + e : String(10 ** e)]);
  drawChart(byId("samples"), {dots, crosses, ticks, logarithmic: true, low: 10 ** low, high: 10 ** high,
    from: 0.5, to: Math.max(state.points_total, 1) + 0.5, fromLabel: "first point", toLabel: "of " + state.points_total});
}

function showLamp() {
  const lines = Object.entries(state.lamp).map(([channel, series]) => ({colour: channelColour(channel),
    points: series.at_s.map((t, i) => [t, 100 * (series.relative_to_first[i] - 1)])}));
  const all = lines.flatMap((line) => line.points);
  const most = Math.max(0.1, ...all.map(([, y]) => Math.abs(y)));
  const from = Math.min(...all.map(([t]) => t), 1e12);
  const to = Math.max(...all.map(([t]) => t), 0);
  const label = (v) => (v > 0 ? "+" : "") + Number(v.toPrecision(2)) + " %";
  drawChart(byId("lamp"), {lines, low: -1.1 * most, high: 1.1 * most, from: all.length ? from : 0, to,
    ticks: [-most, 0, most].map((v) => [v, label(v)]), fromLabel: all.length ? duration(from) : "",
    toLabel: all.length ? duration(to) : ""});
  if (all.length) say("lamp-says", "Monitor readings over the first of each channel; at most " + label(most).replace("+", "") + " off.");
}

function showSphere() {
  const r = state.reconstruction;
  if (r.number !== shownSphere) {
    shownSphere = r.number;
    byId("sphere").src = "/sphere.png?n=" + r.number;
    byId("sphere").hidden = false;
  }
  const made = r.number ? "From " + r.points + " measured point" + (r.points === 1 ? "" : "s") + "." : "";
  say("sphere-says", [made, r.message].filter(Boolean).join(" ") ||
    (state.measured > 0 ? "Being made of " + state.measured + " points." : "Waits for the first point."));
}

function showNotes() {
  if (state.notes_told === shownNotes || state.notes.length === 0) return;
  shownNotes = state.notes_told;
  byId("notes").replaceChildren(...state.notes.slice().reverse().map((note) => {
    const line = document.createElement("li");
    if (!alarming.test(note.kind)) line.className = "plain";
    const when = document.createElement("time");
    when.textContent = duration(note.at_s);
    const kind = document.createElement("b");
    kind.textContent = note.kind;
    line.append(when, kind, note.text);
    return line;
  }));
}

async function update() {
  state = await getJson("/state.json");
  while (points.length < state.points_told) {
    const more = (await getJson("/points.json?from=" + points.length)).points;
    if (more.length === 0) break;
    points.push(...more);
  }
  heard = Date.now();
  draw();
}

function draw() {
  if (!state) return;
  showProgress();
  showFrame();
  showPose();
  showSamples();
  showLamp();
  showSphere();
  showNotes();
}

function lost() {
  if (state && state.is_over) {
    say("says", "The program has ended.");
    return;
  }
  showPhase("no answer", "failed");
  say("says", heard ? "The program has ended or cannot be reached; last heard " +
    new Date(heard).toLocaleTimeString() + "." : "");
}

for (const [id, question] of [["pause", "Finish this point, then pause?"], ["stop", "Stop all axes now?"]]) {
  byId(id).addEventListener("click", async () => {
    if (!window.confirm(question)) return;
    try {
      await post("/" + id);
    } catch (error) {
      window.alert(error.message);
    }
  });
}
turnByDragging(byId("pose"), showPose);
window.addEventListener("resize", draw);
poll(update, 1000, lost);
