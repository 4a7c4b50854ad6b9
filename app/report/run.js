"use strict";
// One moment of the run moves everything: tree, pictures, film, curves and log.
const data = JSON.parse(document.getElementById("data").textContent);
const find = (id) => document.getElementById(id);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const SVG = "http://www.w3.org/2000/svg";
const LEFT = 170, RIGHT = 980, WIDTH = 1000; // px of a chart's time axis, as charts.py draws it
const WORDS = { r: "running", s: "succeeded", f: "failed", i: "idle" };
const SIGNS = { r: "▶", s: "✓", f: "✗", i: "" };
const slider = find("moment");
const film = find("film");
let now = data.end;
let playing = 0; // the handle of the next picture; 0: paused

// The place of the last of ascending numbers that is not after t; -1: none.
function last(count, at, t) {
  let low = 0, high = count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (at(middle) <= t + 1e-6) low = middle + 1; else high = middle;
  }
  return low - 1;
}

const nodes = all(".tree g[data-node]").map((group) => {
  const box = group.querySelector("rect");
  const sign = document.createElementNS(SVG, "text");
  sign.setAttribute("class", "state");
  sign.setAttribute("x", Number(box.getAttribute("x")) + Number(box.getAttribute("width")) - 5);
  sign.setAttribute("y", Number(box.getAttribute("y")) - 1);
  sign.setAttribute("text-anchor", "end");
  group.append(sign);
  return { group, sign, number: Number(group.dataset.node), state: null };
});

function stateOf(number, t) {
  const own = data.changes[number] || [];
  const at = last(own.length / 2, (i) => own[2 * i], t);
  const state = at < 0 ? "i" : own[2 * at + 1];
  return state === "i" && at > 0 ? "i ran" : state; // idle, but it was at work before
}

// Whether a node changed its state at this very moment.
function changedAt(number, t) {
  const own = data.changes[number] || [];
  const at = last(own.length / 2, (i) => own[2 * i], t);
  return at >= 0 && Math.abs(own[2 * at] - t) < 0.03;
}

const byDepth = (a, b) => b.split("/").length - a.split("/").length;

function showTree(t) {
  const running = [];
  for (const node of nodes) {
    const state = stateOf(node.number, t);
    if (state === "r") running.push(data.paths[node.number]);
    if (state === node.state) continue;
    node.state = state;
    node.group.setAttribute("class", state);
    node.sign.textContent = SIGNS[state[0]];
  }
  const leaves = running.filter((path) => !running.some((other) => other.startsWith(path + "/")));
  const failed = nodes.filter((node) => node.state === "f").map((node) => data.paths[node.number]).sort(byDepth);
  const told = find("states");
  const failing = nodes.filter((node) => node.state === "f" && changedAt(node.number, t)).map((node) => data.paths[node.number]);
  const deepest = failed.filter((path) => failing.some((other) => `${path}/`.startsWith(`${other}/`)));
  if (!playing) reveal([deepest, leaves, failed, data.paths.slice(0, 1)].find((some) => some.length) || []);
  if (told) told.textContent = `Running: ${leaves.join(", ") || "nothing"}. Failed: ${failed.join(", ") || "nothing"}.`;
}

// Bring the first of these nodes into the tree's window.
function reveal(paths) {
  const box = document.querySelector(".tree");
  const node = nodes.find((one) => data.paths[one.number] === paths[0]);
  if (!node) return;
  const place = node.group.getBoundingClientRect(), frame = box.getBoundingClientRect();
  if (place.top < frame.top + 30 || place.bottom > frame.bottom - 30) box.scrollTop += place.top - frame.top - frame.height / 2;
  if (place.left < frame.left + 10 || place.right > frame.right - 10) box.scrollLeft += place.left - frame.left - frame.width / 2;
}

const cameras = all(".camera[data-camera]").map((figure) => ({
  figure, frames: all(".frame", figure), caption: figure.querySelector(".caption"), none: figure.querySelector(".none"),
}));

function showPictures(t) {
  for (const { frames, caption, none } of cameras) {
    const at = last(frames.length, (i) => Number(frames[i].dataset.t), t);
    frames.forEach((frame, i) => { frame.hidden = i !== at; });
    none.hidden = at >= 0;
    const age = at < 0 ? 0 : t - Number(frames[at].dataset.t);
    caption.textContent = at < 0 ? "" : frames[at].dataset.caption + (age > 0.06 ? ` (${age.toFixed(1)} s before)` : "");
  }
}

const charts = all("svg.lanes, .curves svg.chart").map((svg) => {
  const { width, height } = svg.viewBox.baseVal;
  const cursor = document.createElementNS(SVG, "line");
  cursor.setAttribute("class", "cursor");
  cursor.setAttribute("y1", 0);
  cursor.setAttribute("y2", height - (width / WIDTH) * 24);
  svg.append(cursor);
  svg.addEventListener("pointerdown", (event) => { drag(svg, event); svg.setPointerCapture(event.pointerId); });
  svg.addEventListener("pointermove", (event) => { if (event.buttons & 1) drag(svg, event); });
  return { cursor, width };
});

function drag(svg, event) {
  const box = svg.getBoundingClientRect();
  const x = ((event.clientX - box.left) / box.width) * WIDTH;
  if (x >= LEFT - 4) pick(((x - LEFT) / (RIGHT - LEFT)) * data.end);
}

function showCharts(t) {
  const x = LEFT + (RIGHT - LEFT) * (data.end ? t / Math.max(data.end, 0.1) : 0);
  for (const { cursor, width } of charts) {
    for (const end of ["x1", "x2"]) cursor.setAttribute(end, (x / WIDTH) * width);
    const box = cursor.ownerSVGElement.parentElement;
    const at = (x / WIDTH) * cursor.ownerSVGElement.clientWidth;
    if (at < box.scrollLeft || at > box.scrollLeft + box.clientWidth) box.scrollLeft = at - box.clientWidth / 2;
  }
  data.panels.forEach((panel, i) => panel.curves.forEach((curve, j) => {
    const at = last(curve.t.length, (n) => curve.t[n], t);
    const old = at >= 0 && t - curve.t[at] > 1 ? ` at ${curve.t[at].toFixed(1)} s` : "";
    find(`reading-${i}-${j}`).textContent = at < 0 || curve.v[at] === null ? "–" : String(curve.v[at]);
    find(`reading-${i}-${j}`).nextElementSibling.textContent = find(`reading-${i}-${j}`).nextElementSibling.dataset.unit + old;
  }));
  const stamp = find("reading-time");
  if (stamp) stamp.textContent = `${t.toFixed(2)} s`;
}

const lines = all("#log tbody tr").map((row) => ({ row, t: Number(row.dataset.t), text: row.textContent.toLowerCase() }));

function showLog(t) {
  const at = last(lines.length, (i) => lines[i].t, t);
  lines.forEach(({ row }, i) => {
    row.classList.toggle("later", i > at);
    row.classList.toggle("now", at >= 0 && lines[i].t === lines[at].t);
  });
  if (at >= 0) {
    const box = document.querySelector(".log"), row = lines[at].row;
    if (row.offsetTop < box.scrollTop + 30 || row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) {
      box.scrollTop = row.offsetTop - box.clientHeight / 2;
    }
  }
  return at < 0 ? "" : lines[at].row.cells[2].textContent;
}

function show(t) {
  now = Math.min(Math.max(t, 0), data.end);
  slider.value = now;
  find("clock").textContent = `${now.toFixed(2)} s`;
  showTree(now);
  showPictures(now);
  showCharts(now);
  const event = showLog(now);
  const busy = data.work.filter(([from, to]) => from <= now + 1e-6 && now < to).map((one) => one[2].split("/").pop());
  const words = `${busy.length ? "at work: " + [...new Set(busy)].join(", ") : "nothing is running"}${event ? " · last event: " + event : ""}`;
  find("now").setAttribute("aria-live", playing ? "off" : "polite");
  find("now").textContent = words;
  slider.setAttribute("aria-valuetext", `${now.toFixed(2)} seconds, ${words}`);
  if (film && !playing && film.readyState > 0) film.currentTime = Math.min(now, film.duration || now);
}

function pick(t) { pause(); show(t); }

function pause() {
  if (!playing) return;
  cancelAnimationFrame(playing);
  playing = 0;
  if (film) film.pause();
  find("play").textContent = "▶";
  find("play").setAttribute("aria-label", "Play");
  show(now);
}

function play() {
  if (now >= data.end - 1e-3) show(0);
  const speed = Number(find("speed").value), begun = performance.now(), from = now;
  find("play").textContent = "❚❚";
  find("play").setAttribute("aria-label", "Pause");
  if (film) { film.currentTime = from; film.playbackRate = speed; film.play().catch(() => {}); }
  const step = (stamp) => {
    playing = requestAnimationFrame(step);
    show(from + Math.max(0, stamp - begun) / 1000 * speed);
    if (now >= data.end) pause();
  };
  playing = requestAnimationFrame(step);
}

const after = (stops) => stops.find((t) => t > now + 1e-3);
const before = (stops) => stops.filter((t) => t < now - 1e-3).pop();
const steps = {
  play: () => (playing ? pause() : play()),
  back: () => pick(before(data.stops) ?? 0),
  forth: () => pick(after(data.stops) ?? data.end),
  fail: () => { if (data.failures.length) pick(after(data.failures) ?? data.failures[0]); },
};
for (const [id, act] of Object.entries(steps)) find(id).addEventListener("click", act);
find("speed").addEventListener("change", () => { if (playing) { pause(); play(); } });
slider.addEventListener("input", () => pick(Number(slider.value)));
document.addEventListener("click", (event) => {
  const go = event.target.closest("button.go");
  if (!go) return;
  pick(Number(go.dataset.t));
  if (!go.closest("#course")) find("course").scrollIntoView();
});
const KEYS = { " ": "play", b: "back", f: "forth", n: "fail" };
const ARROWS = { ArrowLeft: -1, ArrowRight: 1 };  // the slider takes them itself when it has the focus
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (ARROWS[event.key] && event.target === document.body) {
    slider.stepUp(ARROWS[event.key]);
    pick(Number(slider.value));
    event.preventDefault();
  }
  if (!KEYS[event.key]) return;
  const typing = event.target.matches("input[type=search], select");
  const presses = event.key === " " && event.target.matches("button, summary");
  if (typing || presses) return;
  event.preventDefault();
  steps[KEYS[event.key]]();
});

find("filter").addEventListener("input", (event) => {
  const words = event.target.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const line of lines) {
    line.row.hidden = !words.every((word) => line.text.includes(word));
    count += !line.row.hidden;
  }
  find("found").textContent = words.length ? `${count} of ${lines.length} lines` : "";
});

if (film) film.addEventListener("loadedmetadata", () => { film.currentTime = Math.min(now, film.duration); }, { once: true });
window.addEventListener("beforeprint", () => {
  all(".frame").forEach((frame) => { frame.hidden = false; });
  all("details").forEach((part) => { part.open = true; });
});
window.addEventListener("afterprint", () => showPictures(now));
show(data.begin);
