"use strict";
// The page of several runs: their tracks on one map, their figures in the same charts, and one cursor over all.

const LOOKS = [
  { colour: legible("#0072b2"), fill: "rgba(0, 114, 178, 0.13)", dash: [] },
  { colour: legible("#d55e00"), fill: "rgba(213, 94, 0, 0.13)", dash: [7, 4] },
  { colour: legible("#009e73"), fill: "rgba(0, 158, 115, 0.13)", dash: [2, 3] },
  { colour: legible("#cc79a7"), fill: "rgba(204, 121, 167, 0.13)", dash: [9, 3, 2, 3] },
];

// The texts of all runs, each under the names of those that it belongs to.
function together(runs, textOf) {
  const texts = [...new Set(runs.map((run) => textOf(run.facts)))];
  return texts.map((text) => `${runs.filter((run) => textOf(run.facts) === text).map((run) => run.facts.name).join(" · ")}\n\n${text}`).join("\n\n");
}

// The times of all runs in order; `place` of a run says where each of its scans is among them. Scans that runs share, also
// several of one time, are there once.
function mergedTimes(runs) {
  const next = runs.map(() => 0), time = [];
  for (const run of runs) run.place = new Uint32Array(run.scans.count);
  for (;;) {
    const heads = runs.map((run, i) => next[i] < run.scans.count ? run.scans.time[next[i]] + run.shift : Infinity);
    const least = Math.min(...heads);
    if (least === Infinity) return Float64Array.from(time);
    heads.forEach((head, i) => { if (head === least) runs[i].place[next[i]++] = time.length; });
    time.push(least);
  }
}

// One table of times for all runs. A run whose times have none in common with the first one's begins when that one does.
function joined(runs, facts) {
  const first = runs[0], begin = first.scans.time[0], end = first.scans.time[first.scans.count - 1];
  for (const run of runs) {
    const own = run.scans.time;
    run.shift = own[0] > end || own[own.length - 1] < begin ? begin - own[0] : 0;
  }
  const time = mergedTimes(runs);
  const sensors = runs.map((run) => Object.keys(run.facts.sensors).join());
  const alike = sensors.every((names) => names === sensors[0]);
  return {
    runs,
    scans: { time, count: time.length },
    facts: {
      ...first.facts, sensors: alike ? first.facts.sensors : {}, metrics: facts.metrics, names: facts.runs.map(({ name }) => name),
      words: together(runs, ({ words }) => words),
      config: together(runs, ({ config }) => config),
    },
  };
}

// The maps of all runs on one canvas, with one view. Page treats it as it treats the map of one run.
class MapOfRuns {
  constructor(data, state, canvas) {
    Object.assign(this, { data, state });
    this.maps = data.runs.map((run, i) => {
      run.tracks.colour = run.tracks.colour.map((colour, t) => run.tracks.confirmed[t] ? LOOKS[i].colour : THEME.grey);
      const own = { scan: 0, track: -1, return: -1, layers: {}, sensors: Object.keys(run.facts.sensors).map(() => true) };
      return Object.assign(new SceneMap(run, own, canvas), { dash: LOOKS[i].dash, over: i > 0, same: i > 0 && run.facts.same });
    });
    const [first] = this.maps;
    for (const map of this.maps) map.view = first.view;
    first.box = this.maps.map(({ box }) => box).reduce((a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[2], b[2]), Math.max(a[3], b[3])]);
  }

  get width() { return this.maps[0].width; }
  get context() { return this.maps[0].context; }
  set stale(value) { for (const map of this.maps) map.stale = value; }
  resize() { for (const map of this.maps) map.resize(); }
  fit() { this.maps[0].fit(); this.stale = true; }
  zoom(...how) { this.maps[0].zoom(...how); this.stale = true; }
  pan(...how) { this.maps[0].pan(...how); this.stale = true; }
  px(x) { return this.maps[0].px(x); }
  py(y) { return this.maps[0].py(y); }

  // Brings each run to the time and the choice of the page; -1 is a scan before its first.
  follow() {
    const { data, state } = this;
    this.maps.forEach((map, i) => {
      const chosen = state.run === i, own = map.state, on = state.runs[i];
      own.scan = lastAtOrBefore(map.data.place, state.scan);
      Object.assign(own, { track: chosen ? state.track : -1, return: chosen ? state.return : -1 });
      if (Object.keys(data.facts.sensors).length) own.sensors = state.sensors;
      const once = !map.same;
      own.layers = { ...state.layers, tracks: state.layers.tracks && on, paths: state.layers.paths && on, frames: state.layers.frames && i === 0,
        returns: state.layers.returns && once, truth: state.layers.truth && once };
    });
  }

  draw() {
    const [first] = this.maps;
    if (!first.width || !first.height) return;
    this.follow();
    first.clear();
    for (const map of this.maps) if (map.state.scan >= 0) map.paint();
  }

  pick(px, py) {
    let found = null;
    this.maps.forEach((map, i) => {
      if (!this.state.runs[i] || map.state.scan < 0) return;
      const own = map.pick(px, py);
      if (own && (!found || (found.track === undefined && own.track !== undefined))) found = { ...own, run: i };
    });
    return found;
  }
}

// The charts of all runs at the scans that one of them has.
function chartsOfRuns(data, state) {
  const { scans, runs, facts } = data, all = Array.from(scans.time, (_, s) => s), unit = facts.unit;
  const percent = `${Math.round(100 * facts.band)} % bands`;
  const filter = Object.keys(facts.sensors).length ? state.sensors : null;
  const spread = (values, i) => {
    const found = new Array(scans.count).fill(NaN), own = runs[i].scans;
    runs[i].place.forEach((s, k) => { if (!filter || filter[own.sensor[k]]) found[s] = values[k]; });
    return found;
  };
  const line = (name, i, banded) => {
    const own = runs[i].scans, look = LOOKS[i], gaps = own.count === scans.count;
    const values = spread(own[name], i), told = values.slice();
    for (let s = 1, k = -1; !gaps && s < scans.count; s++) {  // between its scans it is as after the last of them
      while (k + 1 < own.count && runs[i].place[k + 1] <= s) k++;
      if (k >= 0 && runs[i].place[k] < s) told[s] = own[name][k];
    }
    return { name: runs[i].facts.name, values, told, colour: look.colour, dash: look.dash, gaps, fill: look.fill,
      ...(banded ? { low: spread(own[`${name}_low`], i), high: spread(own[`${name}_high`], i) } : {}) };
  };
  const shownRuns = runs.map((_, i) => i).filter((i) => state.runs[i]);
  const chart = (title, name, more = {}, banded = false) => ({ scans: all, log: false, title, ...more, lines: shownRuns.map((i) => line(name, i, banded)) });
  return [
    chart(`Position error, RMS over the covered objects [${unit}]`, "position_rmse"),
    chart(`NEES of the position, mean over the objects; expected: its number of axes; ${percent}`, "nees", { log: true }, true),
    chart(`NIS, mean over the tracks with a return; expected: the number of measured axes; ${percent}`, "nis", { log: true }, true),
    ...(facts.objects.length ? [chart("Objects that a track covers", "covered")] : []),
  ];
}

// The figures of each run after the scan that is shown, and what was picked.
class DetailsOfRuns extends Details {
  constructor(page, data, state, host) {
    super(data, state, host, (what) => page.choose(what));
    this.page = page;
    this.each = data.runs.map((run, i) => new Details(run, page.map.maps[i].state, host, (what) => page.choose({ ...what, run: i })));
  }

  show() {
    const { state, host, data, page } = this;
    if (state.track >= 0 || state.return >= 0) {
      if (page.map.maps[state.run].state.scan >= 0) this.each[state.run].show();
      host.prepend(element("p", data.runs[state.run].facts.name, "hint"));
      return;
    }
    const scans = page.map.maps.map((map) => map.state.scan), unit = data.facts.unit;
    const rows = [["time [s]", "time"], ["returns", "returns"], ["objects covered", "covered"], [`position error [${unit}]`, "position_rmse"], ["NEES", "nees"], ["NIS", "nis"]];
    const table = element("table", "", "list"), top = table.createTHead().insertRow(), body = table.createTBody();
    top.append(element("td"));
    data.runs.forEach((run, i) => top.append(this.head(run.facts.name, LOOKS[i].colour)));
    for (const [about, name] of rows) {
      const row = body.insertRow();
      row.append(element("th", about));
      data.runs.forEach((run, i) => {
        const cell = element("td", scans[i] < 0 ? "–" : shown(run.scans[name][scans[i]]));
        cell.dataset.value = `${i}.${name}`;
        row.append(cell);
      });
    }
    host.replaceChildren(element("h2", `Scan ${state.scan + 1} of ${data.scans.count}`), table, element("p", "Click a track or a return on the map.", "hint"));
  }

  head(name, colour) {
    const head = element("th", name);
    head.style.color = colour;
    return head;
  }
}

// A line as the run's tracks are drawn, for the box that turns it on and off.
function sample(look) {
  const line = document.createElementNS("http://www.w3.org/2000/svg", "svg"), path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  line.setAttribute("width", 34);
  line.setAttribute("height", 10);
  Object.entries({ d: "M1 5H33", stroke: look.colour, "stroke-width": 2.5, "stroke-dasharray": look.dash.join(" ") }).forEach(([key, value]) => path.setAttribute(key, value));
  line.append(path);
  return line;
}

function partsOfRuns(page, data, state) {
  state.runs = data.runs.map(() => true);
  page.map = new MapOfRuns(data, state, byId("map"));
  page.switches = data.runs.map((run, i) => {
    const box = page.switch(run.facts.name, state.runs, i);
    box.append(sample(LOOKS[i]));
    return box;
  });
  byId("runs").append(...page.switches);
  return {
    charts: new Charts(data, state, byId("charts"), (scan) => page.goTo(scan), () => chartsOfRuns(data, state)),
    timeline: new Timeline(data, state, byId("timeline"), (track, run) => page.choose({ track, run })),
    details: new DetailsOfRuns(page, data, state, byId("details")),
  };
}

async function openRuns() {
  const facts = readFacts(), runs = await Promise.all(facts.runs.map((own, i) => readData(own, i)));
  const taken = runs.filter((run) => run.scans.count);
  if (taken.length === runs.length) window.page = new Page(joined(runs, facts), partsOfRuns);
  else byId("overview").textContent = "One of the runs took no scan.";
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
}
openRuns();
