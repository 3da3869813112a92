"use strict";
// The tables that `readData` returns, of a run that goes on: scans are added as they come.

const MOST_SCANS = 20000, MOST_ENTRIES = 600000;  // beyond either, the older three quarters of the scans are let go
const WIDTHS = { platform: 2, ray: 2 };           // numbers of a column in each row, if not 1
const INDICES = {                                 // columns that are not sent
  scans: [["number", "u4"]],
  entries: [["scan", "u4"], ["track", "u4"], ["firstWeight", "u4"], ["weightCount", "u1"]],
  truth: [["scan", "u4"], ["object", "u4"]],
};
const UNUSED = ["entries.gap", "truth.gap", "truth.count", "weights.count"];  // what the indices say

class LiveData {
  constructor(facts) {
    this.facts = facts;
    this.colours = new Map();  // of the tracks that were ever confirmed, by their ids
    this.columns = {};
    for (const table of ["scans", "returns", "entries", "weights", "truth"]) {
      const sent = facts.columns.filter(([name]) => name.startsWith(`${table}.`) && !UNUSED.includes(name));
      const names = sent.map(([name, type]) => ({ name: name.slice(table.length + 1), sent: name, type }));
      const own = (INDICES[table] || []).map(([name, type]) => ({ name, type }));
      this.columns[table] = [...names, ...own].map((column) => ({ ...column, width: WIDTHS[column.name] || 1 }));
    }
    this.byId = new Map();
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.tracks = { id: [], rows: [], confirmed: [], colour: [] };
    this.used = {};
    this.room = {};
    for (const table in this.columns) this[table] = {};
    for (const table in this.columns) {
      this.used[table] = this.room[table] = 0;
      this.grow(table, 64);
    }
    this.scans.count = 0;
    this.scans.firstReturn = [0];
    this.truth.rows = facts.objects.map(() => []);
    for (const table of [this.entries, this.truth]) table.atScan = { first: [0], row: [] };
  }

  // Makes room for so many rows.
  grow(table, rows) {
    if (rows <= this.room[table]) return;
    this.room[table] = Math.max(rows, 2 * this.room[table]);
    for (const { name, type, width } of this.columns[table]) {
      const before = this[table][name], made = new NUMBERS[type](this.room[table] * width);
      if (type.startsWith("f")) made.fill(NaN, before?.length ?? 0);
      if (before) made.set(before);
      this[table][name] = made;
    }
    if (this.weights) Object.assign(this.weights, { first: this.entries.firstWeight, count: this.entries.weightCount });
  }

  // The columns of some scans, of the bytes of their record from a place on; records.py says what they are.
  read(buffer, at) {
    const { columns } = this.facts, [bytes, first, scans, , x, y, ...sizes] = new Float64Array(buffer, at, 6 + columns.length);
    const record = { bytes, first, scans, centre: [x, y] };
    let from = at + 8 * (6 + columns.length);
    columns.forEach(([name, type], i) => {
      record[name] = new NUMBERS[type](buffer, from, sizes[i]);
      from += 8 * Math.ceil(record[name].byteLength / 8);
    });
    return record;
  }

  // Adds scans; before, lets the oldest go if there are too many.
  append(record) {
    if (this.scans.count >= MOST_SCANS || this.used.entries >= MOST_ENTRIES) this.forget();
    this.facts.centre = record.centre;
    this.add("returns", record["returns.x"].length, record);
    this.add("weights", record["weights.weight"].length, record);
    this.add("scans", record.scans, record);
    const before = this.scans.count, platform = record["scans.platform"], first = this.scans.firstReturn;
    this.scans.count += record.scans;
    record["scans.returns"].forEach((count, i) => {
      first.push(first.at(-1) + count);
      this.scans.number[before + i] = record.first + i;
      this.extend(platform[2 * i], platform[2 * i + 1]);
    });
    this.addEntries(record, before);
    this.addTruth(record, before);
  }

  // Adds rows that stay in the order in which they come.
  add(table, rows, record) {
    this.grow(table, this.used[table] + rows);
    for (const { name, sent, width } of this.columns[table]) if (sent) this[table][name].set(record[sent], this.used[table] * width);
    this.used[table] += rows;
  }

  addEntries(record, before) {
    const { entries, tracks } = this, groups = Array.from(record["tracks.id"], (id) => this.track(id));
    const counts = record["weights.count"], first = starts(counts), weights = this.used.weights - record["weights.weight"].length;
    this.addRows("entries", tracks, groups, record["tracks.count"], record["entries.gap"], record, before, (e, i, t) => {
      entries.track[e] = t;
      entries.firstWeight[e] = weights + first[i];
      entries.weightCount[e] = counts[i];
      if (entries.confirmed[e] && !tracks.confirmed[t]) this.confirm(t);
      if (entries.x && entries.confirmed[e] && entries.miss[e] < 0.5) this.extend(entries.x[e], entries.y[e]);
    });
  }

  addTruth(record, before) {
    const { truth } = this, objects = truth.rows.map((_, object) => object);
    this.addRows("truth", truth, objects, record["truth.count"], record["truth.gap"], record, before, (row, _, object) => {
      truth.object[row] = object;
      this.extend(truth.x[row], truth.y[row]);
    });
  }

  // Adds rows that come group by group, so many of each, every one with its distance in scans from the one before, in the
  // order of their scans. `each` is told of every row, where it came from, and of which group it is.
  addRows(name, groups, numbers, counts, gaps, record, before, each) {
    const { scan, group } = scansAndGroups(counts, gaps), { first, row: order } = byScan(scan, record.scans);
    const table = this[name], { atScan } = table, begin = this.used[name];
    this.grow(name, begin + order.length);
    for (const { name: column, sent } of this.columns[name]) {
      const to = table[column], from = record[sent];
      if (sent) for (let k = 0; k < order.length; k++) to[begin + k] = from[order[k]];
    }
    order.forEach((i, k) => {
      const row = begin + k, g = numbers[group[i]];
      table.scan[row] = before + scan[i];
      groups.rows[g].push(row);
      atScan.row.push(row);
      each(row, i, g);
    });
    for (let s = 1; s <= record.scans; s++) atScan.first.push(begin + first[s]);
    this.used[name] += order.length;
  }

  // Which row of the table of tracks has this id.
  track(id) {
    const known = this.byId.get(id), { tracks } = this, t = tracks.id.length;
    if (known !== undefined) return known;
    this.byId.set(id, t);
    tracks.id.push(id);
    tracks.confirmed.push(0);
    tracks.colour.push(THEME.grey);
    tracks.rows.push([]);
    if (this.colours.has(id)) this.confirm(t);
    return t;
  }

  confirm(t) {
    const { tracks, colours } = this, id = tracks.id[t], many = this.facts.colours.tracks;
    if (!colours.has(id)) colours.set(id, legible(many[colours.size % many.length]));
    tracks.confirmed[t] = 1;
    tracks.colour[t] = colours.get(id);
  }

  // Lets the map hold a place.
  extend(x, y) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) return;
    const { box } = this;
    box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
  }

  // Keeps the latest quarter of the scans.
  forget() {
    const { scans, entries, truth, tracks, used } = this, gone = scans.count - Math.ceil(scans.count / 4);
    const weights = entries.firstWeight.subarray(entries.atScan.first[gone], used.entries).reduce((a, b) => Math.min(a, b), used.weights);
    const from = { scans: gone, returns: scans.firstReturn[gone], entries: entries.atScan.first[gone], truth: truth.atScan.first[gone], weights };
    for (const table in from) {
      for (const { name, width } of this.columns[table]) this[table][name].copyWithin(0, from[table] * width, used[table] * width);
      used[table] -= from[table];
    }
    scans.count -= gone;
    const later = (numbers, less) => numbers.map((number) => number - less).filter((number) => number >= 0);
    scans.firstReturn = later(scans.firstReturn.slice(gone), from.returns);
    for (const [table, name] of [[entries, "entries"], [truth, "truth"]]) {
      for (let row = 0; row < used[name]; row++) table.scan[row] -= gone;
      table.atScan = { first: later(table.atScan.first.slice(gone), from[name]), row: later(table.atScan.row, from[name]) };
    }
    for (let e = 0; e < used.entries; e++) entries.firstWeight[e] -= weights;
    truth.rows = truth.rows.map((rows) => later(rows, from.truth));
    tracks.rows = tracks.rows.map((rows) => later(rows, from.entries));
    const kept = tracks.rows.flatMap((rows, t) => rows.length ? [t] : []);
    for (const name in tracks) tracks[name] = kept.map((t) => tracks[name][t]);
    this.byId = new Map(tracks.id.map((id, t) => [id, t]));
    tracks.rows.forEach((rows, t) => { for (const e of rows) entries.track[e] = t; });
  }
}
