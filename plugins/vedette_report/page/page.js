"use strict";
// Puts the parts of the page together: what is chosen, the slider and its playback, and what each input does.

const LAYERS = {
  frames: ["frames", true], returns: ["returns", true], truth: ["truth", true], tracks: ["tracks", true], paths: ["whole paths", true],
  tentative: ["tentative", false], ellipses: ["95 % ellipses", true], gates: ["gates", false], views: ["sensor's view", false],
};
const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100];
const byId = (id) => document.getElementById(id);

function overview({ facts, scans, tracks, runs }) {
  if (runs) return runs.map((run) => `${run.facts.name}: ${overview(run)}`).join("; ");
  const confirmed = tracks.confirmed.reduce((sum, each) => sum + each, 0), span = scans.time[scans.count - 1] - scans.time[0];
  const counts = [`${counted(scans.count, "scan")} over ${shown(span)} s`, `${counted(confirmed, "confirmed track")} of ${tracks.id.length} begun`];
  if (facts.objects.length) counts.push(counted(facts.objects.length, "true object"));
  return counts.join(" · ");
}

// The parts of the page of one run.
function partsOfRun(page, data, state) {
  return {
    map: new SceneMap(data, state, byId("map")),
    charts: new Charts(data, state, byId("charts"), (scan) => page.goTo(scan)),
    timeline: new Timeline(data, state, byId("timeline"), (track) => page.choose({ track })),
    details: new Details(data, state, byId("details"), (what) => page.choose(what)),
  };
}

class Page {
  constructor(data, parts = partsOfRun) {
    this.data = data;
    this.state = {
      scan: 0, run: 0, track: -1, return: -1, playing: false, speed: 10,
      layers: Object.fromEntries(Object.entries(LAYERS).map(([name, [, on]]) => [name, on])),
      sensors: Object.keys(data.facts.sensors).map(() => true),
    };
    Object.assign(this, parts(this, data, this.state));
    this.fillTexts();
    this.connect();
    this.resize();
    this.map.fit();
    this.goTo(this.firstToShow());
  }

  // The first scan with returns and a confirmed track; where there is none the first with returns.
  firstToShow() {
    const { scans, entries, runs } = this.data;
    if (runs) return 0;
    const seen = (s) => scans.returns[s] > 0, all = Array.from({ length: scans.count }, (_, s) => s);
    const confirmed = (s) => entries.atScan.row.slice(entries.atScan.first[s], entries.atScan.first[s + 1]).some((e) => entries.confirmed[e]);
    return Math.max(0, all.find((s) => seen(s) && confirmed(s)) ?? all.find(seen) ?? 0);
  }

  fillTexts() {
    const { facts } = this.data;
    byId("overview").textContent = overview(this.data);
    byId("words").textContent = facts.words;
    byId("config").textContent = facts.config;
    byId("figures").append(...metricsTables(facts.metrics, facts.names || [""]));
    byId("life-about").textContent = `grey while tentative; those that were ever confirmed${this.data.runs ? ", run by run" : ""}`;
    if (!facts.map) byId("scene").classList.add("no-map");
  }

  connect() {
    const slider = byId("slider");
    slider.max = this.data.scans.count - 1;
    slider.addEventListener("input", () => this.goTo(Number(slider.value)));
    byId("play").addEventListener("click", () => this.play(!this.state.playing));
    const speed = byId("speed");
    for (const value of SPEEDS) speed.append(new Option(`${value}×`, value, value === this.state.speed, value === this.state.speed));
    speed.addEventListener("change", () => { this.state.speed = Number(speed.value); });
    const none = { frames: !this.data.facts.frames.length, truth: !this.data.facts.objects.length };
    for (const [name, [label]] of Object.entries(LAYERS)) if (!none[name]) byId("layers").append(this.switch(label, this.state.layers, name));
    const sensors = Object.keys(this.data.facts.sensors);
    if (sensors.length > 1) sensors.forEach((name, i) => byId("sensors").append(this.switch(name, this.state.sensors, i)));
    byId("fit").addEventListener("click", () => { this.map.fit(); this.map.draw(); });
    byId("zoom-in").addEventListener("click", () => { this.map.zoom(1.5); this.map.draw(); });
    byId("zoom-out").addEventListener("click", () => { this.map.zoom(1 / 1.5); this.map.draw(); });
    this.connectMap(byId("map"));
    window.addEventListener("resize", () => this.resize());
    document.addEventListener("keydown", (event) => {
      if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
      if (event.key === " " && event.target.tagName !== "BUTTON") { event.preventDefault(); this.play(!this.state.playing); }
      if (event.key === "ArrowRight") this.goTo(this.state.scan + 1);
      if (event.key === "ArrowLeft") this.goTo(this.state.scan - 1);
      if (event.key === "Escape") this.choose({});
    });
  }

  // A box that turns a layer or a sensor on and off.
  switch(label, flags, key) {
    const box = element("label"), input = element("input");
    input.type = "checkbox";
    input.checked = flags[key];
    input.dataset.layer = key;
    input.addEventListener("change", () => {
      flags[key] = input.checked;
      this.map.stale = true;
      if (flags !== this.state.layers) {
        this.charts.rebuild();
        this.timeline.draw();
      }
      this.map.draw();
    });
    box.append(input, label);
    return box;
  }

  connectMap(canvas) {
    const held = new Map();
    let moved = 0;
    const redraw = () => { if (!this.asked) { this.asked = true; requestAnimationFrame(() => { this.asked = false; this.map.draw(); }); } };
    canvas.addEventListener("pointerdown", (event) => {
      held.set(event.pointerId, [event.offsetX, event.offsetY]);
      canvas.setPointerCapture(event.pointerId);
      if (held.size === 1) moved = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const dx = event.offsetX - before[0], dy = event.offsetY - before[1];
      moved += Math.abs(dx) + Math.abs(dy);
      if (held.size === 2) {
        const other = [...held].find(([id]) => id !== event.pointerId)[1];
        const apart = (at) => Math.max(Math.hypot(at[0] - other[0], at[1] - other[1]), 1);
        this.map.zoom(apart([event.offsetX, event.offsetY]) / apart(before), other[0], other[1]);
      } else this.map.pan(dx, dy);
      held.set(event.pointerId, [event.offsetX, event.offsetY]);
      redraw();
    });
    const release = (event) => {
      if (event.type === "pointerup" && held.size === 1 && moved < 6) this.choose(this.map.pick(event.offsetX, event.offsetY) || {});
      held.delete(event.pointerId);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.map.zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
      redraw();
    }, { passive: false });
  }

  resize() {
    const first = !this.map.width;
    this.map.resize();
    if (!first) this.map.draw();
    if (first) this.charts.rebuild();
    else this.charts.resize();
    this.timeline.draw();
  }

  goTo(scan) {
    const { state, data } = this;
    const next = Math.max(0, Math.min(scan, data.scans.count - 1));
    if (next !== state.scan) state.return = -1;  // a return is of one scan
    state.scan = next;
    this.showTime(next);
    this.map.draw();
    this.charts.moveTo(next);
    this.timeline.moveTo(next);
    this.details.show();
  }

  showTime(scan) {
    const slider = byId("slider"), text = clockOf(this.data, scan);
    slider.value = scan;
    slider.setAttribute("aria-valuetext", `${text}, scan ${scan + 1} of ${this.data.scans.count}`);
    byId("clock").textContent = text;
  }

  choose({ track = -1, return: row = -1, run = 0 }) {
    const changed = track !== this.state.track || run !== this.state.run;
    Object.assign(this.state, { run, track, return: row });
    if (changed) {
      this.charts.rebuild();
      this.timeline.draw();
    }
    this.map.draw();
    this.details.show();
  }

  play(on) {
    const { state, data } = this, times = data.scans.time;
    if (on && state.scan === data.scans.count - 1) this.goTo(0);
    state.playing = on;
    byId("play").textContent = on ? "❚❚" : "▶";
    byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
    let clock = times[state.scan], before = performance.now(), last = state.scan, drawn = -Infinity;
    const pause = CALM ? 1000 : 0;  // ms between two pictures
    const step = (now) => {
      if (!state.playing) return;
      if (state.scan !== last) clock = times[state.scan];  // moved by hand
      clock += state.speed * (now - before) / 1000;
      before = now;
      const scan = lastAtOrBefore(times, clock);
      if (scan !== state.scan && now - drawn >= pause) {
        this.goTo(scan);
        drawn = now;
      }
      last = state.scan;
      if (state.scan >= data.scans.count - 1) this.play(false);
      else requestAnimationFrame(step);
    };
    if (on) requestAnimationFrame(step);
  }
}
