"use strict";
// Charts against time by uPlot. They are drawn when the choice changes; a move of the slider moves a line over them only.

const BAND = "rgba(0, 114, 178, 0.13)";

class Charts {
  // `specs`, if given, says what is drawn instead of the charts of all or of the track that is chosen.
  constructor(data, state, host, onTime, specs) {
    Object.assign(this, { data, state, host, onTime, specs });
    this.begin = data.scans.count ? data.scans.time[0] : 0;
    this.plots = [];
    this.spans = false;  // whether lines go on over scans without a value
  }

  // Draws the charts of the track that is chosen, else those of all.
  rebuild(filled = this.filled()) {
    for (const plot of this.plots) plot.chart.destroy();
    this.host.replaceChildren();
    const frames = filled.map((spec) => this.frame(spec));  // all of them first: together they have their widths
    this.plots = filled.map((spec, i) => this.plot(spec, frames[i]));
    this.moveTo(this.state.scan);
  }

  // Draws what has been added since, in the charts that are there where they stay the same.
  update() {
    const { plots } = this, filled = this.filled();
    const same = filled.length === plots.length && plots.every(({ look }, i) => look === this.look(filled[i]));
    if (!same) return this.rebuild(filled);
    plots.forEach((plot, i) => {
      plot.spec = filled[i];
      plot.chart.setData(this.columns(filled[i]));
      this.describe(plot.frame, plot.spec);
    });
    this.moveTo(this.state.scan);
  }

  look({ title, lines }) { return [title, this.spans, ...lines.map(({ colour }) => colour)].join(); }

  // What charts show, but for those without any value.
  filled() {
    const specs = this.specs ? this.specs() : this.state.track >= 0 ? this.ofTrack(this.state.track) : this.ofAll();
    return specs.filter((spec) => spec.lines.some((line) => line.values.some(Number.isFinite)));
  }

  ofAll() {
    const { scans } = this.data, keep = [];
    for (let s = 0; s < scans.count; s++) if (this.state.sensors[scans.sensor[s]]) keep.push(s);
    const of = (values) => keep.map((s) => values[s]);
    const unit = this.data.facts.unit, percent = `${Math.round(100 * this.data.facts.band)} % band`;
    const common = { scans: keep, log: false };
    return [
      { ...common, title: `Position error, RMS over the covered objects [${unit}]`,
        lines: [{ name: "error", values: of(scans.position_rmse), colour: BLUE }] },
      { ...common, title: "NEES of the position, mean over the objects; expected: its number of axes", log: true, band: percent,
        lines: [{ name: "NEES", values: of(scans.nees), colour: BLUE }], low: of(scans.nees_low), high: of(scans.nees_high) },
      { ...common, title: "NIS, mean over the tracks with a return; expected: the number of measured axes", log: true, band: percent,
        lines: [{ name: "NIS", values: of(scans.nis), colour: BLUE }], low: of(scans.nis_low), high: of(scans.nis_high) },
      { ...common, title: "Objects that a track covers",
        lines: [{ name: "covered", values: this.data.facts.objects.length ? of(scans.covered) : [], colour: BLUE }] },
    ];
  }

  ofTrack(track) {
    const { entries, tracks, scans, facts } = this.data, shows = (e) => this.state.sensors[scans.sensor[entries.scan[e]]];
    const rows = Array.from(tracks.rows[track]).filter(shows);
    const of = (values) => rows.map((e) => values[e]), colour = tracks.colour[track], unit = facts.unit;
    const common = { scans: rows.map((e) => entries.scan[e]), log: false }, id = tracks.id[track];
    const percent = `${Math.round(100 * facts.band)} % band of one value`;
    const sigma = of(entries.position_sigma);
    const two = (bands) => rows.map((e) => bands(entries.scan[e]));
    const bands = Object.values(facts.sensors).map((sensor) => sensor.band);
    return [
      { ...common, title: `Track ${id}: position error [${unit}]`, band: "2 standard deviations by its own covariance",
        lines: [{ name: "error", values: of(entries.position_error), colour }], low: sigma.map(() => 0), high: sigma.map((v) => 2 * v) },
      { ...common, title: `Track ${id}: NEES of the position`, log: true, band: percent,
        lines: [{ name: "NEES", values: of(entries.nees), colour, dots: true }], low: two(() => facts.nees_band ? facts.nees_band[0] : NaN), high: two(() => facts.nees_band ? facts.nees_band[1] : NaN) },
      { ...common, title: `Track ${id}: NIS where a return was probably its own`, log: true, band: percent,
        lines: [{ name: "NIS", values: of(entries.nis_given_hit), colour, dots: true }],
        low: two((s) => bands[scans.sensor[s]][0]), high: two((s) => bands[scans.sensor[s]][1]) },
      { ...common, title: `Track ${id}: mode probabilities`, unit: true,
        lines: facts.modes.map((name, i) => ({ name, values: of(entries[`mode${i}`]), colour: legible(facts.colours.tracks[(i * 7) % 12]) })) },
      { ...common, title: `Track ${id}: existence, and hit`, unit: true,
        lines: [{ name: "existence", values: of(entries.existence), colour }, { name: "hit", values: of(entries.miss).map((miss) => 1 - miss), colour: THEME.grey }] },
    ];
  }

  frame(spec) {
    const frame = document.createElement("div");
    frame.className = "chart";
    frame.setAttribute("role", "img");
    const head = document.createElement("h2"), values = document.createElement("span");
    head.textContent = spec.title;
    values.className = "values";
    frame.append(head, values);
    this.host.append(frame);
    return { frame, values };
  }

  // What belongs to each series of a chart: the time, the edges of its bands, its lines.
  columns(spec) {
    const clean = (list) => list.map((v) => Number.isFinite(v) && !(spec.log && v <= 0) ? v : null);
    const edges = bandsOf(spec).flatMap(({ low, high }) => [clean(high), clean(low)]);
    return [spec.scans.map((s) => this.data.scans.time[s] - this.begin), ...edges, ...spec.lines.map(({ values }) => clean(values))];
  }

  plot(spec, { frame, values }) {
    const series = [{}], bands = [];
    for (const { fill, gaps } of bandsOf(spec)) {
      bands.push({ series: [series.length, series.length + 1], fill });
      for (let edge = 0; edge < 2; edge++) series.push({ stroke: "transparent", points: { show: false }, spanGaps: this.spans || gaps === false });
    }
    for (const line of spec.lines)
      series.push({ stroke: line.colour, dash: line.dash, spanGaps: this.spans || line.gaps === false, width: line.dots ? 0.6 : 1.4, points: { show: Boolean(line.dots), size: 4, width: 0, fill: line.colour } });
    const axis = { stroke: THEME.soft, grid: { stroke: THEME.faint, width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    const chart = new uPlot({
      width: Math.max(200, frame.clientWidth), height: 150, series, bands, legend: { show: false },
      cursor: { x: true, y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: { x: { time: false, range: () => [0, this.length()] }, y: spec.unit ? { range: [0, 1.02] } : spec.log ? { distr: 3 } : { range: (_, low, high) => [Math.min(0, low), (high || 1) * 1.05] } },
      padding: [8, 18, 0, 0],
      axes: [
        { ...axis, size: 24, values: (_, ticks) => ticks.map((v) => `${v} s`) },
        { ...axis, size: 44, ...(spec.log ? { grid: { ...axis.grid, filter: (_, ticks) => ticks.map(powerOfTen) }, filter: (_, ticks) => ticks.map(powerOfTen), values: (_, ticks) => ticks.map((v) => v === null ? "" : String(Number(v.toPrecision(3)))) } : {}) },
      ],
    }, this.columns(spec), frame);
    const now = document.createElement("div");
    now.className = "now";
    chart.over.append(now);
    this.describe(frame, spec);
    const plot = { chart, spec, look: this.look(spec), now, values, frame };
    chart.over.addEventListener("click", () => { if (chart.cursor.idx !== null) this.onTime(plot.spec.scans[chart.cursor.idx]); });
    return plot;
  }

  // Says for readers of screens what a chart shows: the range of each of its lines.
  describe(frame, { title, lines }) {
    const ranges = lines.map(({ name, values }) => {
      const known = Array.from(values).filter(Number.isFinite);
      const [least, most] = known.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
      return `${name} from ${shown(least)} to ${shown(most)} in ${counted(known.length, "scan")}`;
    });
    frame.setAttribute("aria-label", `${title}: ${ranges.join("; ")}`);
  }

  length() { return this.data.scans.time[this.data.scans.count - 1] - this.begin || 1; }

  moveTo(scan) {
    const time = this.data.scans.time[scan] - this.begin;
    for (const { spec, now, values } of this.plots) {
      now.style.left = `${100 * time / this.length()}%`;
      const i = lastAtOrBefore(spec.scans, scan);
      const parts = i >= 0 && spec.scans[i] === scan ? spec.lines.map((line) => `${spec.lines.length > 1 ? line.name + " " : ""}${shown((line.told || line.values)[i])}`) : ["–"];
      const band = spec.band && i >= 0 && spec.scans[i] === scan && spec.low && Number.isFinite(spec.low[i]) ? ` (${spec.band}: ${shown(spec.low[i])} to ${shown(spec.high[i])})` : "";
      values.textContent = parts.join(", ") + band;
    }
  }

  resize() {
    for (const { chart, frame } of this.plots) chart.setSize({ width: Math.max(200, frame.clientWidth), height: 150 });
    this.moveTo(this.state.scan);
  }
}

// The bands of a chart: its own, and those of its lines.
const bandsOf = (spec) => [{ fill: BAND, ...spec }, ...spec.lines].filter(({ low }) => low);

// A tick of a logarithmic axis that is to be seen, or null.
function powerOfTen(value) {
  return value && Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-9 ? value : null;
}

// Where the last of sorted numbers is that is at most `value`; -1 if there is none.
function lastAtOrBefore(sorted, value) {
  let low = 0, high = sorted.length - 1;
  while (low <= high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle - 1;
  }
  return high;
}

// The life of each track: a bar from its first scan to its last, grey while tentative. A click chooses the track. Of several
// runs those that are shown are below one another.
class Timeline {
  constructor(data, state, canvas, onTrack) {
    Object.assign(this, { data, state, canvas, onTrack });
    this.left = 44;
    canvas.addEventListener("click", (event) => {
      const row = this.rows[Math.floor(event.offsetY / this.step)];
      if (row) onTrack(row.track, row.run);
    });
  }

  draw() {
    const { data, state, canvas } = this, runs = data.runs || [data];
    const lived = ({ tracks }, run) => Array.from(tracks.id.keys()).filter((track) => tracks.confirmed[track]).map((track) => ({ run, track }));
    this.rows = runs.flatMap((run, i) => !state.runs || state.runs[i] ? lived(run, i) : []);
    this.step = this.rows.length > 60 ? 6 : 14;
    const ratio = window.devicePixelRatio || 1, width = canvas.parentElement.clientWidth, height = Math.max(20, this.rows.length * this.step + 4);
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "11px system-ui, sans-serif";
    this.width = width;
    this.rows.forEach(({ run, track }, row) => {
      const chosen = track === state.track && run === state.run, every = this.step > 10 ? 1 : 5;
      context.fillStyle = chosen ? THEME.ink : THEME.soft;
      if (row % every === 0 || chosen) context.fillText(String(runs[run].tracks.id[track]), 4, row * this.step + Math.min(this.step - 3, 11));
      this.drawLife(context, runs[run], track, row * this.step, chosen);
    });
    this.moveTo(state.scan);
  }

  drawLife(context, { tracks, entries, scans, shift = 0 }, track, y, chosen) {
    const rows = tracks.rows[track], thin = chosen ? 0 : 2, at = (scan) => this.at(scans.time[Math.min(scan, scans.count - 1)] + shift);
    const goesOn = (e, next) => entries.confirmed[next] === entries.confirmed[e] && entries.scan[next] === entries.scan[e] + 1;
    for (let from = 0; from < rows.length;) {
      let to = from;
      while (to + 1 < rows.length && goesOn(rows[to], rows[to + 1])) to++;
      const begin = at(entries.scan[rows[from]]), end = at(entries.scan[rows[to]] + 1);
      context.fillStyle = entries.confirmed[rows[from]] ? tracks.colour[track] : THEME.grey;
      context.fillRect(begin, y + 1 + thin / 2, Math.max(end - begin, 1.5), this.step - 2 - thin);
      from = to + 1;
    }
  }

  at(time) {
    const { scans } = this.data, begin = scans.time[0], length = scans.time[scans.count - 1] - begin || 1;
    return this.left + (this.width - this.left - 8) * (time - begin) / length;
  }

  moveTo(scan) {
    this.canvas.nextElementSibling.style.transform = `translateX(${this.at(this.data.scans.time[scan])}px)`;
  }
}
