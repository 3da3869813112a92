"use strict";
// Curves with bands, bars and marks as SVG, on linear or logarithmic axes.

const WIDE = 460, HIGH = 250, LEFT = 56, RIGHT = 14, TOP = 10, BOTTOM = 40;
const DASHES = { dashed: "7 3", expected: "6 4" };

function svg(name, attributes, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

// The axis of some values: where each is, from 0 to 1, and which of them are named.
function axisOf(values, log, [least, most] = [null, null]) {
  const known = values.filter((value) => Number.isFinite(value) && !(log && value <= 0));
  let low = Math.min(...known), high = Math.max(...known);
  if (!known.length) [low, high] = log ? [1, 10] : [0, 1];
  const of = log ? Math.log : (value) => value, back = log ? Math.exp : (value) => value;
  const edge = 0.04 * (of(high) - of(low)) || (log ? 0.5 : Math.abs(low) * 0.05 || 0.5);
  low = back(of(low) - edge);
  high = back(of(high) + edge);
  if (least !== null && low < least) low = least;
  if (most !== null && high > most) high = most;
  const ticks = log ? ticksOfLog(low, high) : ticksOf(low, high, known.every(Number.isInteger) ? 1 : 0);
  return { at: (value) => (of(value) - of(low)) / (of(high) - of(low)), ticks };
}

function ticksOf(low, high, least) {
  const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough)), found = [];
  const step = Math.max(power * [1, 2, 5, 10].find((each) => each * power >= rough), least);
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) found.push(Number((i * step).toPrecision(12)));
  return found;
}

function ticksOfLog(low, high) {
  const found = [], of = high < 8 * low ? [1, 2, 3, 4, 5, 6, 8] : high < 200 * low ? [1, 2, 5] : [1];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
    for (const each of of) if (each * 10 ** power >= low && each * 10 ** power <= high) found.push(Number((each * 10 ** power).toPrecision(12)));
  return found;
}

// The ends of a band or a bar: they stay among the values that there can be.
function ends(curve, i, [least, most]) {
  const doubt = curve.doubt ? curve.doubt[i] || 0 : 0;
  return [Math.max(curve.y[i] - doubt, least === null ? -Infinity : least), Math.min(curve.y[i] + doubt, most === null ? Infinity : most)];
}

function plotOf(panel) {
  const { curves, within } = panel;
  const shownAt = (curve) => curve.y.map((_, i) => i).filter((i) => curve.y[i] !== null && curve.x[i] !== null);
  const names = panel.ticks, places = curves.flatMap((curve) => shownAt(curve).flatMap((i) => curve.doubtAcross ? [curve.x[i] - (curve.doubtAcross[i] || 0), curve.x[i] + (curve.doubtAcross[i] || 0)] : [curve.x[i]]));
  const across = axisOf(names.length ? [-0.4, names.length - 0.6] : places, panel.logAcross);
  const upright = axisOf(curves.flatMap((curve) => shownAt(curve).flatMap((i) => ends(curve, i, within))), panel.log, within);
  const px = (x) => LEFT + across.at(x) * (WIDE - LEFT - RIGHT), py = (y) => HIGH - BOTTOM - upright.at(y) * (HIGH - TOP - BOTTOM);
  const figure = svg("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "plot", role: "img", "aria-label": `${panel.upright} against ${panel.across}` });
  const length = Math.floor((WIDE - LEFT - RIGHT) / names.length / 5.5);  // letters that a name has room for
  for (const value of names.length ? names.keys() : across.ticks) {
    const name = names.length ? names[value] : String(value), words = names.length && name.length > length ? `${name.slice(0, length - 1)}…` : name;
    const tick = svg("text", { x: px(value), y: HIGH - BOTTOM + 14, "text-anchor": "middle", class: "tick" }, words);
    if (words !== name) tick.append(svg("title", {}, name));
    figure.append(svg("line", { x1: px(value), x2: px(value), y1: TOP, y2: HIGH - BOTTOM, class: "grid" }), tick);
  }
  for (const value of upright.ticks) {
    figure.append(svg("line", { x1: LEFT, x2: WIDE - RIGHT, y1: py(value), y2: py(value), class: "grid" }));
    figure.append(svg("text", { x: LEFT - 5, y: py(value) + 4, "text-anchor": "end", class: "tick" }, String(value)));
  }
  figure.append(svg("text", { x: (LEFT + WIDE - RIGHT) / 2, y: HIGH - 6, "text-anchor": "middle" }, panel.across));
  for (const curve of curves) drawCurve(figure, curve, shownAt(curve), within, px, py, (x) => names.length ? ` ${names[x]}` : ` at ${x}`);
  return figure;
}

function drawCurve(figure, curve, rows, within, px, py, where) {
  const line = (points) => points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" "), bars = curve.doubtAcross || curve.style === "points";
  const bounds = rows.map((i) => ends(curve, i, within));
  if (curve.doubt && !bars) {
    const edge = [...rows.map((i, k) => [px(curve.x[i]), py(bounds[k][1])]), ...rows.map((i, k) => [px(curve.x[i]), py(bounds[k][0])]).reverse()];
    figure.append(svg("polygon", { points: line(edge), fill: curve.colour, opacity: 0.18, class: "band" }));
  }
  if (["line", "marked", "dashed", "expected"].includes(curve.style))
    figure.append(svg("polyline", { points: line(rows.map((i) => [px(curve.x[i]), py(curve.y[i])])), fill: "none", stroke: curve.colour, "stroke-width": curve.style === "expected" ? 1 : 1.6, "stroke-dasharray": DASHES[curve.style] || "" }));
  rows.forEach((i, k) => {
    const x = px(curve.x[i]), y = py(curve.y[i]);
    if (curve.doubt && bars) figure.append(svg("line", { x1: x, x2: x, y1: py(bounds[k][0]), y2: py(bounds[k][1]), stroke: curve.colour }));
    if (curve.doubtAcross) figure.append(svg("line", { x1: px(curve.x[i] - (curve.doubtAcross[i] || 0)), x2: px(curve.x[i] + (curve.doubtAcross[i] || 0)), y1: y, y2: y, stroke: curve.colour }));
    if (curve.notes[i]) figure.append(svg("text", { x: x + 6, y: y + 13, class: "tick" }, curve.notes[i]));
    const size = { rings: 7, published: 5 }[curve.style] || (["marked", "points"].includes(curve.style) ? 3 : 0);
    const hollow = ["rings", "published"].includes(curve.style);
    if (curve.style === "expected") return;
    const spot = svg("circle", { cx: x, cy: y, r: size || 4, fill: hollow ? "none" : curve.colour, stroke: hollow ? curve.colour : "none", "stroke-width": 2, opacity: size ? 1 : 0 });
    const doubt = curve.doubt && curve.doubt[i] !== null ? ` ± ${Number(curve.doubt[i].toPrecision(3))}` : "";
    spot.append(svg("title", {}, `${curve.label ? curve.label + ": " : ""}${Number(curve.y[i].toPrecision(4))}${doubt}${where(curve.x[i])}`));
    figure.append(spot);
  });
}

// A line of labels, each with the colour of its curve.
function labelsOf(curves) {
  const labels = document.createElement("p");
  labels.className = "labels";
  for (const curve of curves.filter(({ label }) => label)) {
    const label = document.createElement("span"), mark = document.createElement("i");
    mark.className = curve.style === "rings" ? "rings" : "";
    mark.style[mark.className ? "borderColor" : "background"] = curve.colour;
    label.append(mark, curve.label);
    labels.append(label);
  }
  return labels;
}
