"use strict";
// What lies under everything else on the map: the user's lines and areas, meridians and parallels, a grid.

function drawUnderlay(map, context) {
  const lines = map.data.facts.underlay;
  context.strokeStyle = THEME.coast;
  context.fillStyle = THEME.land;
  context.lineWidth = 1;
  for (const { points, closed } of lines) {
    context.beginPath();
    points.forEach(([x, y], i) => {
      const at = [map.px(x - map.data.facts.centre[0]), map.py(y - map.data.facts.centre[1])];
      if (i) context.lineTo(...at);
      else context.moveTo(...at);
    });
    if (closed) { context.closePath(); context.fill(); }
    context.stroke();
  }
}

// Meridians and parallels, each named where it enters the map; parallels clear of the grid's own numbers.
function drawGraticule(map, context) {
  context.strokeStyle = THEME.meridian;
  context.fillStyle = THEME.latitude;
  context.lineWidth = 1;
  context.font = "11px system-ui, sans-serif";
  for (const { points, label } of map.data.facts.graticule) {
    const left = /[NS]$/.test(label) ? 60 : 6;
    let named = false;
    context.beginPath();
    for (const [x, y] of points) {
      const px = map.px(x - map.data.facts.centre[0]), py = map.py(y - map.data.facts.centre[1]);
      context.lineTo(px, py);
      if (!named && px > left && py > 14 && px < map.width - 90 && py < map.height - 24) {
        context.fillText(label, px + 3, py - 3);
        named = true;
      }
    }
    context.stroke();
  }
}

function drawGrid(map, context) {
  const rough = 90 / map.view.scale, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= rough), centre = map.data.facts.centre;
  const unit = map.data.facts.unit, [left, top] = map.placeAt(0, 0), [right, bottom] = map.placeAt(map.width, map.height);
  const label = (value) => unit === "m" && step >= 1000 ? `${Number((value / 1000).toFixed(3))} km` : `${Number(value.toFixed(6))} ${unit}`;
  context.strokeStyle = THEME.faint;
  context.fillStyle = THEME.soft;
  context.lineWidth = 1;
  context.font = "11px system-ui, sans-serif";
  context.beginPath();
  const words = [];
  for (let x = Math.ceil((left + centre[0]) / step) * step; x <= right + centre[0]; x += step) {
    const at = Math.round(map.px(x - centre[0])) + 0.5;
    context.moveTo(at, 0); context.lineTo(at, map.height);
    if (at > 60 && at + 6 + context.measureText(label(x)).width < map.width) words.push([label(x), at + 3, map.height - 5]);
  }
  const [low, high] = [Math.min(top, bottom) + centre[1], Math.max(top, bottom) + centre[1]];
  for (let y = Math.ceil(low / step) * step; y <= high; y += step) {
    const at = Math.round(map.py(y - centre[1])) + 0.5;
    context.moveTo(0, at); context.lineTo(map.width, at);
    if (at > 16 && at < map.height - 22) words.push([label(y), 4, at - 3]);
  }
  context.stroke();
  for (const [text, x, y] of words) context.fillText(text, x, y);
}
