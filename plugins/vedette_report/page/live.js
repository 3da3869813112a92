"use strict";
// The page of a run that goes on: takes each scan that comes, and draws as many of them as it can.

const BEHIND = 2;    // scans that may wait for their own picture; of more, those before the last share its picture
const SLOW = 25;     // what is not drawn with each scan waits so many times as long as it takes, at least
const KEPT = 5000;   // delays of scans from which their quantiles are told
const FRAMES = 50;   // pictures of a camera that are kept

class Live {
  constructor(facts) {
    this.data = new LiveData(facts);
    this.following = true;
    this.shown = -1;                 // which of the received scans was drawn last
    this.stats = { received: 0, drawn: 0, after: 0, lost: 0, delays: [] };
    this.jobs = [                    // what is not drawn with each scan: how often at most, in ms; when again; of how many scans
      { draw: () => this.drawPaths(), every: 100 }, { draw: () => this.drawDetails(), every: 200 },
      { draw: () => this.drawCharts(), every: 300 }, { draw: () => this.drawOverview(), every: 1000 },
    ].map((job) => ({ ...job, next: 0, scans: 0 }));
    this.pictures = [];
    this.came = [];                  // when those scans came whose pictures are being drawn
    this.channel = new MessageChannel();
    this.channel.port1.onmessage = () => this.measure();
    this.status = document.createElement("p");
    this.status.id = "live";
    document.querySelector("header").append(this.status);
    this.tell("waiting for the first scan");
    this.source = new EventSource("events");
    this.source.addEventListener("message", (event) => this.take(event.data));
    this.source.addEventListener("picture", (event) => this.takePicture(JSON.parse(event.data)));
    this.source.addEventListener("lost", (event) => { this.stats.lost += Number(event.data); });
    this.source.addEventListener("ended", (event) => this.end(event.data));
    this.source.addEventListener("error", () => { if (!this.ended) this.tell("no connection; trying again"); });
  }

  tell(text) { this.status.textContent = text; }

  take(text) {
    const bytes = bytesOf(text), { data } = this;
    for (let at = 0; at < bytes.length;) {
      const record = data.read(bytes.buffer, at), count = data.scans.count;
      at += record.bytes;
      data.append(record);
      if (data.scans.count < count + record.scans) this.moved(count + record.scans - data.scans.count);
      this.stats.received += record.scans;
    }
    if (!window.page) this.open();
    this.ask();
  }

  // The older scans were let go: all scans have moved by so many.
  moved(by) {
    const { page } = window;
    if (!page) return;
    const id = page.state.track >= 0 ? this.chosenId : undefined;
    Object.assign(page.state, { scan: Math.max(0, page.state.scan - by), return: -1, track: this.data.byId.get(id) ?? -1 });
    page.charts.begin = this.data.scans.time[0];
    this.placePictures();
    page.map.stale = true;
  }

  open() {
    const page = window.page = new Page(this.data), { map } = page;
    for (const id of ["figures", "words"]) byId(id).closest("details").remove();  // they are of a whole run
    this.fits = true;                // whether the map shows all that there is, until somebody moves it
    const { fit, zoom, pan } = map;
    map.fit = () => { this.fits = true; this.fit(fit); };
    map.zoom = (...by) => { this.fits = false; zoom.apply(map, by); };
    map.pan = (...by) => { this.fits = false; pan.apply(map, by); };
    map.fit();
    page.charts.spans = true;  // where comparing with the truth is slow, few scans have a value: lines go on over the others
    const goTo = page.goTo, play = page.play, choose = page.choose;
    page.goTo = (scan) => { this.follow(false); goTo.call(page, scan); };
    page.play = (on) => { if (this.following) this.follow(false); else play.call(page, on); };
    page.choose = (what) => { choose.call(page, what); this.chosenId = this.data.tracks.id[page.state.track]; };
    this.button = document.createElement("button");
    this.button.type = "button";
    this.button.id = "follow";
    this.button.textContent = "live";
    this.button.title = "Show each scan as it comes";
    this.button.addEventListener("click", () => { if (page.state.playing) play.call(page, false); this.follow(true); this.ask(); });
    byId("player").append(this.button);
    this.follow(true);
    for (const job of this.jobs) job.next = performance.now() + job.every;  // the page has just drawn all that
    document.documentElement.dataset.ready = String(Math.round(performance.now()));
  }

  follow(on) {
    this.following = on;
    if (on) this.shown = Math.min(this.shown, this.stats.received - 2);  // the last scan is drawn again
    this.button.setAttribute("aria-pressed", on);
    if (!page.state.playing) byId("play").textContent = on ? "❚❚" : "▶";
  }

  // All that there is, with some room around it, so that not each scan changes the view.
  fit(fit) {
    const { map } = page, box = this.data.box[2] >= this.data.box[0] ? this.data.box : map.bounds();
    const room = 0.1 * Math.max(box[2] - box[0], box[3] - box[1], 1e-9);
    map.box = this.fitted = [box[0] - room, box[1] - room, box[2] + room, box[3] + room];
    fit.call(map);
  }

  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  draw() {
    const { stats } = this, waiting = stats.received - 1 - this.shown;
    if (!this.following) this.shown = stats.received - 1;
    else if (waiting > 0) this.drawScan(waiting > BEHIND ? stats.received - 1 : this.shown + 1);
    this.drawMore();
    if (this.shown < stats.received - 1 || this.jobs.some((job) => job.scans < stats.received)) this.ask();
  }

  drawScan(scan) {
    const { data, stats, fitted } = this, { map, state } = page, { box, scans } = data, gone = stats.received - scans.count;
    const first = Math.max(0, this.shown + 1 - gone);
    this.shown = scan;
    state.scan = Math.max(0, scan - gone);
    state.return = -1;
    if (this.fits && (box[0] < fitted[0] || box[1] < fitted[1] || box[2] > fitted[2] || box[3] > fitted[3])) map.fit();
    map.draw();
    byId("clock").textContent = clockOf(data, state.scan);
    stats.drawn++;
    this.came.push(scans.came.slice(first, state.scan + 1));
    this.channel.port2.postMessage(0);  // it arrives after this has been painted
  }

  // Notes how long it took from each scan to the first picture that has it, once there was a picture.
  measure() {
    const { stats } = this, now = performance.timeOrigin + performance.now();
    stats.first ??= now;
    const later = this.came.shift().filter((came) => 1000 * came > stats.first);
    for (const came of later) stats.delays.push(now - 1000 * came);
    stats.after += later.length;
    if (stats.delays.length > KEPT) stats.delays.splice(0, stats.delays.length - KEPT);
  }

  drawDetails() {
    byId("slider").max = this.data.scans.count - 1;
    page.showTime(page.state.scan);
    if (this.following) page.details.show();
    if (!this.ended) this.tell(this.story());
  }

  story() {
    const { stats } = this, sorted = [...stats.delays].sort((a, b) => a - b), late = sorted[Math.floor(0.99 * (sorted.length - 1))];
    const words = [this.following ? "live" : "goes on", `${stats.received} scans`];
    if (late !== undefined) words.push(`shown ${shown(late)} ms after they came (99 % of the last ${sorted.length})`);
    if (stats.lost) words.push(`${stats.lost} missed: this page was too slow`);
    return words.join(" · ");
  }

  // What need not be drawn with each scan, or takes too long: one thing at a time, so that no scan waits for all of them.
  drawMore() {
    const now = performance.now(), job = this.jobs.find(({ next, scans }) => now >= next && scans < this.stats.received);
    if (!job) return;
    job.draw();
    const end = performance.now();
    Object.assign(job, { scans: this.stats.received, next: end + Math.max(job.every, SLOW * (end - now)) });
  }

  drawCharts() { page.charts.update(); }

  drawOverview() {
    const { confirmed } = this.data.tracks, objects = this.data.facts.objects.length;
    const words = [`${counted(confirmed.reduce((sum, each) => sum + each, 0), "confirmed track")} of ${confirmed.length} begun`];
    byId("overview").textContent = [...words, ...(objects ? [counted(objects, "true object")] : [])].join(" · ");
    page.timeline.draw();
  }

  drawPaths() {
    if (!page.map.stale) page.map.drawPaths();
  }

  // A picture of what a camera saw lies under its scan once it is decoded.
  async takePicture(frame) {
    const image = new Image();
    image.src = `data:image/png;base64,${frame.png}`;
    await image.decode();
    this.pictures = [...this.pictures, { corner: frame.corner, size: frame.size, number: frame.scan, image }].slice(-FRAMES);
    if (window.page) this.placePictures();
  }

  placePictures() {
    const { map } = page, { number, count } = this.data.scans;
    map.frames = this.pictures.map((each) => ({ ...each, scan: lastAtOrBefore(number.subarray(0, count), each.number) }));
    map.frameScans = map.frames.map((each) => each.scan);
  }

  end(why) {
    this.ended = why;
    this.source.close();
    while (window.page && this.shown < this.stats.received - 1) this.draw();
    if (window.page) {
      this.follow(false);
      this.button.hidden = true;
      for (const job of this.jobs) job.draw();
      page.details.show();
    }
    this.tell(`${why} · ${this.stats.received} scans`);
    document.documentElement.dataset.ended = why;
  }
}

window.live = new Live(JSON.parse(document.getElementById("facts").textContent));
