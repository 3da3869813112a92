"use strict";
// What the sensors saw, and from where: frames, returns, lines of bearing, platforms and how far each of them sees.

const FADE = 12;  // scans whose returns are still to be seen

// Pixel i covers the square around i.
function drawFrame(map) {
  const frame = map.frameAt(map.state.scan), { context } = map;
  if (!frame || !frame.image.complete) return;
  context.imageSmoothingEnabled = false;
  const [x, y] = frame.corner.map((value, i) => value - 0.5 - map.data.facts.centre[i]), [width, height] = frame.size;
  context.drawImage(frame.image, map.px(x), map.py(y), width * map.view.scale, height * map.view.scale);
  context.imageSmoothingEnabled = true;
}

// On whole pixels, where squares are drawn fastest.
function drawReturns(map) {
  const { data, state, context } = map, { returns, scans } = data;
  for (let s = Math.max(0, state.scan - FADE); s <= state.scan; s++) {
    if (!state.sensors[scans.sensor[s]]) continue;
    const now = s === state.scan, size = now ? 4 : 2;
    context.globalAlpha = now ? 0.95 : 0.14 + 0.3 * (1 - (state.scan - s) / FADE);
    context.fillStyle = now ? THEME.ink : THEME.grey;
    for (let r = scans.firstReturn[s]; r < scans.firstReturn[s + 1]; r++) {
      const x = map.px(returns.x[r]), y = map.py(returns.y[r]);
      if (x >= -5 && y >= -5 && x <= map.width + 5 && y <= map.height + 5) context.fillRect(Math.round(x - size / 2), Math.round(y - size / 2), size, size);
      else if (now && returns.ray && Number.isFinite(returns.ray[2 * r])) drawRay(map, r, s);
    }
  }
  context.globalAlpha = 1;
}

function drawRay(map, r, s) {
  const [x, y] = standing(map.data, s), { context, data } = map, far = 2 * (map.width + map.height);
  if (!Number.isFinite(x)) return;
  context.strokeStyle = THEME.soft;
  context.lineWidth = 0.7;
  context.beginPath();
  context.moveTo(map.px(x), map.py(y));
  context.lineTo(map.px(x) + far * data.returns.ray[2 * r], map.py(y) + map.up() * far * data.returns.ray[2 * r + 1]);
  context.stroke();
}

// Where the sensor of a scan stands.
function standing({ scans, facts }, s) {
  const place = Object.values(facts.sensors)[scans.sensor[s]].place;
  if (Number.isFinite(scans.platform[2 * s])) return [scans.platform[2 * s], scans.platform[2 * s + 1]];
  return place ? [place[0] - facts.centre[0], place[1] - facts.centre[1]] : [NaN, NaN];
}

// What the sensor of the scan sees: arcs of directions, each with its nearest and its farthest place.
function drawView(map) {
  const { data, state, context } = map, { scans, facts } = data, s = state.scan, [x, y] = standing(data, s);
  const { view } = Object.values(facts.sensors)[scans.sensor[s]];
  if (!view || !Number.isFinite(x)) return;
  const heading = Number.isFinite(scans.heading[s]) ? scans.heading[s] : 0, swapped = facts.map.axes[0] === "y";
  const beyond = 2 * (map.width + map.height) / map.view.scale;
  const at = ([bearing], range) => {
    const along = [Math.cos(bearing + heading), Math.sin(bearing + heading)];
    if (swapped) along.reverse();
    return [map.px(x + range * along[0]), map.py(y + range * along[1])];
  };
  context.strokeStyle = THEME.soft;
  context.lineWidth = 1;
  context.setLineDash([5, 4]);
  for (const { closed, rows } of view) {
    const far = rows.map((row) => at(row, row[2] === null ? beyond : row[2])), near = rows.map((row) => at(row, row[1])).reverse();
    const limited = rows.some((row) => row[2] !== null);
    if (closed && limited) strokeClosed(context, far);
    if (closed && rows.some((row) => row[1] > 0)) strokeClosed(context, near);
    if (!closed) strokeClosed(context, [...far, ...near]);
  }
  context.setLineDash([]);
}

function strokeClosed(context, points) {
  context.beginPath();
  for (const point of points) context.lineTo(...point);
  context.closePath();
  context.stroke();
}

function drawPlatform(map) {
  const { context } = map, [x, y] = standing(map.data, map.state.scan);
  if (!Number.isFinite(x)) return;
  context.fillStyle = "#ffd23f";
  context.strokeStyle = THEME.ink;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(map.px(x), map.py(y) - 8);
  context.lineTo(map.px(x) + 7, map.py(y) + 5);
  context.lineTo(map.px(x) - 7, map.py(y) + 5);
  context.closePath();
  context.fill();
  context.stroke();
}
