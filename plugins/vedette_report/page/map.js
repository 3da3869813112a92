"use strict";
// The map: a layer of what does not move, drawn when the view changes, and what belongs to the scan on top of it.

const ELLIPSE = -2 * Math.log(0.05);  // squared distance that holds 95 % in the plane
const TAIL = 40;                      // scans of a track's history that are drawn strongly

class SceneMap {
  constructor(data, state, canvas) {
    Object.assign(this, { data, state, canvas });
    this.context = canvas.getContext("2d", { alpha: false });  // composed faster
    this.still = document.createElement("canvas");
    this.view = { x: 0, y: 0, scale: 1 };
    this.stale = true;
    this.dash = [];      // of the tracks
    this.over = false;   // another map, which has the ground, lies under this one
    this.same = false;   // that map shows the same scans
    this.box = this.bounds();
    this.frames = data.facts.frames.map((frame) => ({ ...frame, image: new Image() }));
    this.frameScans = this.frames.map((frame) => frame.scan);
  }

  // The last frame up to a scan; the first time it is asked for, its picture is decoded and the map drawn again.
  frameAt(scan) {
    const frame = this.frames[lastAtOrBefore(this.frameScans, scan)];
    if (frame && !frame.image.src) {
      frame.image.onload = () => this.draw();
      frame.image.src = `data:image/png;base64,${frame.png}`;
    }
    return frame;
  }

  // Truth, platforms, and confirmed tracks where they had a return: one that is lost must not stretch the map.
  bounds() {
    const { entries, truth, returns, scans, facts } = this.data;
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    const add = (x, y) => {
      if (!Number.isFinite(x) || !Number.isFinite(y)) return;
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    };
    for (let i = 0; i < truth.x.length; i++) add(truth.x[i], truth.y[i]);
    for (let i = 0; i < scans.count; i++) add(scans.platform[2 * i], scans.platform[2 * i + 1]);
    for (const { place } of Object.values(facts.sensors)) if (place) add(place[0] - facts.centre[0], place[1] - facts.centre[1]);
    for (let i = 0; entries.x && i < entries.x.length; i++)
      if (entries.confirmed[i] && entries.miss[i] < 0.5) add(entries.x[i], entries.y[i]);
    if (!(box[2] > box[0] || box[3] > box[1])) for (let i = 0; i < returns.x.length; i++) add(returns.x[i], returns.y[i]);
    for (const { corner, size } of facts.frames.slice(0, 1)) {
      add(corner[0] - facts.centre[0], corner[1] - facts.centre[1]);
      add(corner[0] + size[0] - facts.centre[0], corner[1] + size[1] - facts.centre[1]);
    }
    return box[2] >= box[0] ? box : [-1, -1, 1, 1];
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    for (const each of [this.canvas, this.still]) {
      each.width = Math.round(this.width * ratio);
      each.height = Math.round(this.height * ratio);
      each.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    this.stale = true;
  }

  fit() {
    const [left, low, right, high] = this.box;
    this.view.scale = 0.9 * Math.min(this.width / Math.max(right - left, 1e-9), this.height / Math.max(high - low, 1e-9));
    if (!Number.isFinite(this.view.scale) || this.view.scale > 1e6) this.view.scale = 1;
    this.view.x = 0.5 * (left + right);
    this.view.y = 0.5 * (low + high);
    this.stale = true;
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.placeAt(px, py);
    this.view.scale *= factor;
    const [newX, newY] = this.placeAt(px, py);
    this.view.x += x - newX;
    this.view.y += y - newY;
    this.stale = true;
  }

  pan(dx, dy) {
    this.view.x -= dx / this.view.scale;
    this.view.y -= this.up() * dy / this.view.scale;
    this.stale = true;
  }

  // -1 on the ground, where the second axis points up; 1 in images, where it points down.
  up() { return this.data.facts.unit === "px" ? 1 : -1; }
  px(x) { return this.width / 2 + (x - this.view.x) * this.view.scale; }
  py(y) { return this.height / 2 + this.up() * (y - this.view.y) * this.view.scale; }
  placeAt(px, py) {
    return [this.view.x + (px - this.width / 2) / this.view.scale, this.view.y + this.up() * (py - this.height / 2) / this.view.scale];
  }

  draw() {
    if (!this.width || !this.height) return;  // not laid out yet
    this.clear();
    this.paint();
  }

  clear() {
    this.context.fillStyle = THEME.paper;
    this.context.fillRect(0, 0, this.width, this.height);
  }

  // Draws on what is there.
  paint() {
    if (this.stale) this.drawStill();
    const { context, state, width, height } = this;
    if (state.layers.frames) drawFrame(this);
    context.drawImage(this.still, 0, 0, width, height);
    if (state.layers.returns) drawReturns(this);
    if (state.layers.truth) this.drawTruthNow();
    if (state.layers.views && !this.same) drawView(this);
    if (!this.same) drawPlatform(this);
    this.drawTracks();
    this.drawChosen();
  }

  drawStill() {
    const context = this.still.getContext("2d");
    context.clearRect(0, 0, this.width, this.height);
    if (!this.over) {
      drawUnderlay(this, context);
      drawGrid(this, context);
      drawGraticule(this, context);
    }
    this.pens = { truth: [], entries: [] };
    this.drawPaths();
    this.stale = false;
  }

  // Draws the paths, each on from where it ended when it was drawn last.
  drawPaths() {
    const { data, state, pens } = this, { entries, tracks } = data;
    if (state.layers.truth) this.drawPathsOf(data.truth, data.truth, pens.truth, () => THEME.ink, () => true, 1, 0.55);
    if (!state.layers.paths || !entries.x) return;
    const context = this.still.getContext("2d"), wanted = (t) => tracks.confirmed[t] || state.layers.tentative;
    context.setLineDash(this.dash);
    this.drawPathsOf(entries, tracks, pens.entries, (t) => tracks.colour[t], wanted, 1.2, 0.3);
    context.setLineDash([]);
  }

  drawPathsOf(table, groups, pens, colour, wanted, width, alpha) {
    const context = this.still.getContext("2d");
    Object.assign(context, { lineWidth: width, globalAlpha: alpha, lineJoin: "round" });
    groups.rows.forEach((rows, g) => {
      const pen = pens[g] ??= { drawn: 0, x: NaN, y: NaN };
      if (rows.length === pen.drawn || !wanted(g)) return;
      context.strokeStyle = colour(g);
      context.beginPath();
      this.trace(context, table, rows, pen.drawn, rows.length, pen);
      context.stroke();
      pen.drawn = rows.length;
    });
    context.globalAlpha = 1;
  }

  // Draws a line from the pen on through some of these rows, and leaves the pen where it ends: less than a pixel is not seen.
  trace(context, { x, y }, rows, from, to, pen) {
    context.moveTo(pen.x, pen.y);
    for (let i = from; i < to; i++) {
      const px = this.px(x[rows[i]]), py = this.py(y[rows[i]]);
      if (Math.abs(px - pen.x) + Math.abs(py - pen.y) < 0.7) continue;
      context.lineTo(px, py);
      pen.x = px;
      pen.y = py;
    }
  }

  drawTruthNow() {
    const { data, state, context } = this, { truth } = data;
    context.fillStyle = THEME.ink;
    context.font = "italic 12px system-ui, sans-serif";
    const few = truth.atScan.first[state.scan + 1] - truth.atScan.first[state.scan] <= 40;
    for (let k = truth.atScan.first[state.scan]; k < truth.atScan.first[state.scan + 1]; k++) {
      const i = truth.atScan.row[k], x = this.px(truth.x[i]), y = this.py(truth.y[i]);
      context.strokeStyle = THEME.ink;
      context.lineWidth = 1.4;
      context.strokeRect(x - 4, y - 4, 8, 8);
      if (few) this.write(data.facts.objects[truth.object[i]], x + 8, y + 15, THEME.ink);
    }
  }

  write(text, x, y, colour) {
    const { context } = this;
    context.lineWidth = 3;
    context.strokeStyle = THEME.veil;
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }

  drawTracks() {
    const { data, state, context } = this, { entries, tracks } = data;
    if (!entries.x || !state.layers.tracks) return;
    const from = entries.atScan.first[state.scan], to = entries.atScan.first[state.scan + 1], few = to - from <= 120;
    const sensor = Object.values(data.facts.sensors)[data.scans.sensor[state.scan]];
    context.font = "bold 12px system-ui, sans-serif";
    for (let k = from; k < to; k++) {
      const e = entries.atScan.row[k], t = entries.track[e], confirmed = entries.confirmed[e];
      if (!confirmed && !state.layers.tentative && t !== state.track) continue;
      const x = this.px(entries.x[e]), y = this.py(entries.y[e]), colour = tracks.colour[t], chosen = t === state.track;
      if (x < -200 || y < -200 || x > this.width + 200 || y > this.height + 200) continue;
      context.strokeStyle = colour;
      context.lineWidth = chosen ? 3.5 : 2;
      context.globalAlpha = confirmed ? 1 : 0.6;
      context.setLineDash(this.dash);
      context.beginPath();
      const rows = tracks.rows[t], last = placeAt(data, t, state.scan);
      this.trace(context, entries, rows, Math.max(0, last - TAIL), last + 1, { x: NaN, y: NaN });
      context.stroke();
      context.setLineDash([]);
      context.lineWidth = chosen ? 2 : 1;
      if (entries.width && entries.height) {  // the box of a target in images
        const width = entries.width[e] * this.view.scale, height = entries.height[e] * this.view.scale;
        context.strokeRect(x - width / 2, y - height / 2, width, height);
      }
      if (state.layers.ellipses) this.ellipse(x, y, entries.covXX[e], entries.covXY[e], entries.covYY[e], ELLIPSE);
      if ((state.layers.gates || chosen) && sensor.gate && Number.isFinite(entries.gateXX[e])) {
        context.setLineDash([3, 3]);
        const gx = this.px(entries.x[e] + entries.gateX[e]), gy = this.py(entries.y[e] + entries.gateY[e]);
        this.ellipse(gx, gy, entries.gateXX[e], entries.gateXY[e], entries.gateYY[e], sensor.gate);
        context.setLineDash([]);
      }
      context.fillStyle = colour;
      context.beginPath();
      context.arc(x, y, chosen ? 5 : 3, 0, 2 * Math.PI);
      context.fill();
      if ((few && confirmed) || chosen) this.write(String(tracks.id[t]), x + 7, y - 7, colour);
    }
    context.globalAlpha = 1;
  }

  // The ellipse of a covariance around a place in px, where the squared distance is `limit`.
  ellipse(x, y, xx, xy, yy, limit) {
    const middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
    const long = Math.sqrt(limit * (middle + half)) * this.view.scale;
    const short = Math.sqrt(limit * Math.max(0, middle - half)) * this.view.scale;
    if (!Number.isFinite(long) || long < 1.5) return;
    this.context.beginPath();
    this.context.ellipse(x, y, long, short, this.up() * 0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
    this.context.stroke();
  }

  // The return that was picked, or lines from the track that was picked to its returns, as wide as their weights.
  drawChosen() {
    const { data, state, context } = this, { returns, entries } = data;
    const ring = (r, colour) => {
      context.strokeStyle = colour;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(this.px(returns.x[r]), this.py(returns.y[r]), 7, 0, 2 * Math.PI);
      context.stroke();
    };
    if (state.track >= 0) {
      const e = entryAt(data, state.track, state.scan);
      for (const { row, weight } of e < 0 ? [] : weightsOf(data, e)) {
        if (!Number.isFinite(returns.x[row])) continue;
        context.strokeStyle = data.tracks.colour[state.track];
        context.lineWidth = 0.5 + 3 * weight;
        context.beginPath();
        context.moveTo(this.px(entries.x[e]), this.py(entries.y[e]));
        context.lineTo(this.px(returns.x[row]), this.py(returns.y[row]));
        context.stroke();
        ring(row, data.tracks.colour[state.track]);
      }
    }
    if (state.return >= 0) ring(state.return, THEME.accent);
  }

  // What lies under a place in px: {track}, or where there is none {return}, or nothing.
  pick(px, py) {
    const { data, state } = this, { entries, returns, scans } = data;
    let best = 16, found = null;
    const near = (x, y, reach, what) => {
      const away = Math.hypot(this.px(x) - px, this.py(y) - py);
      if (away < Math.min(best, reach)) { best = away; found = what; }
    };
    for (let k = entries.atScan.first[state.scan]; entries.x && k < entries.atScan.first[state.scan + 1]; k++) {
      const e = entries.atScan.row[k];
      if (entries.confirmed[e] || state.layers.tentative) near(entries.x[e], entries.y[e], 16, { track: entries.track[e] });
    }
    if (!found && state.layers.returns && state.sensors[scans.sensor[state.scan]])
      for (let r = scans.firstReturn[state.scan]; r < scans.firstReturn[state.scan + 1]; r++)
        near(returns.x[r], returns.y[r], 10, { return: r });
    return found;
  }
}
