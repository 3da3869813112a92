"use strict";
// The tables that `readData` returns, of a run that goes on: scans are added as they come.

const MOST_SCANS = 20000, MOST_ENTRIES = 600000;  // beyond either, the older three quarters of the scans are let go
const ROOM = 16;                                  // rows that a track has room for at first; later twice as many, and so on
const WIDTHS = { platform: 2, ray: 2 };           // numbers of a column in each row, if not 1
const INDICES = {                                 // columns that are not sent
  scans: [["number", "u4"]],
  entries: [["scan", "u4"], ["track", "u4"], ["slot", "u4"], ["firstWeight", "u4"], ["weightCount", "u1"]],
  truth: [["scan", "u4"], ["object", "u4"], ["slot", "u4"]],
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
    this.clear();
  }

  clear() {
    const none = this.facts.objects.map(() => 0);
    this.records = [];
    this.byId = new Map();
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.tracks = { id: [], first: [], end: [], room: [], confirmed: [], colour: [] };
    this.used = {};
    this.room = {};
    for (const table in this.columns) this[table] = {};
    for (const table in this.columns) {
      this.used[table] = this.room[table] = 0;
      this.grow(table, 64);
    }
    this.scans.count = 0;
    this.scans.firstReturn = [0];
    Object.assign(this.truth, { first: [...none], end: [...none], room: [...none] });
    for (const table of [this.entries, this.truth]) table.atScan = { first: [0], row: [] };
  }

  // Makes room for so many rows.
  grow(table, rows) {
    if (rows <= this.room[table]) return;
    this.room[table] = Math.max(rows, 2 * this.room[table]);
    for (const { name, type, width } of this.columns[table]) {
      const before = this[table][name], made = new NUMBERS[type](this.room[table] * width);
      if (type.startsWith("f")) made.fill(NaN);
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
    this.records.push(record);
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
    const rows = this.addRows("entries", tracks, groups, record["tracks.count"], record["entries.gap"], record, before);
    const { track, firstWeight, weightCount, confirmed, x, y, miss } = entries, counts = record["weights.count"];
    let weight = this.used.weights - record["weights.weight"].length;
    rows.row.forEach((e, i) => {
      const t = track[e] = groups[rows.group[i]];
      firstWeight[e] = weight;
      weightCount[e] = counts[i];
      weight += counts[i];
      if (confirmed[e] && !tracks.confirmed[t]) this.confirm(t);
      if (x && confirmed[e] && miss[e] < 0.5) this.extend(x[e], y[e]);
    });
  }

  addTruth(record, before) {
    const { truth } = this, objects = this.facts.objects.map((_, object) => object);
    const rows = this.addRows("truth", truth, objects, record["truth.count"], record["truth.gap"], record, before);
    rows.row.forEach((row, i) => {
      truth.object[row] = rows.group[i];
      this.extend(truth.x[row], truth.y[row]);
    });
  }

  // Adds rows that come group by group, so many of each, every one with its distance in scans from the one before.
  addRows(name, groups, numbers, counts, gaps, record, before) {
    const { scan, group, first } = scansAndGroups(counts, gaps), row = new Uint32Array(scan.length);
    for (let g = 0; g < counts.length; g++) {
      if (!counts[g]) continue;
      const begin = this.place(name, groups, numbers[g], counts[g]);
      for (let i = first[g]; i < first[g + 1]; i++) row[i] = begin + i - first[g];
    }
    for (const { name: column, sent } of this.columns[name]) {
      const to = this[name][column], from = record[sent];
      if (sent) for (let i = 0; i < row.length; i++) to[row[i]] = from[i];
    }
    const { atScan, slot, scan: scans } = this[name], place = atScan.row.length, sorted = byScan(scan, record.scans);
    sorted.row.forEach((i, k) => {
      slot[row[i]] = place + k;
      atScan.row.push(row[i]);
      scans[row[i]] = before + scan[i];
    });
    for (let s = 1; s <= record.scans; s++) atScan.first.push(place + sorted.first[s]);
    return { row, group };
  }

  // The first of so many new rows at the end of a group. Where it has no room left, it moves to the end of the table.
  place(name, groups, g, rows) {
    const table = this[name], size = groups.end[g] - groups.first[g];
    if (size + rows > groups.room[g]) {
      const first = this.used[name], room = Math.max(ROOM, 2 * (size + rows));
      this.grow(name, first + room);
      for (const column of this.columns[name]) table[column.name].copyWithin(first, groups.first[g], groups.end[g]);
      for (let i = first; i < first + size; i++) table.atScan.row[table.slot[i]] = i;
      this.used[name] += room;
      groups.first[g] = first;
      groups.end[g] = first + size;
      groups.room[g] = room;
    }
    groups.end[g] += rows;
    return groups.end[g] - rows;
  }

  // Which row of the table of tracks has this id.
  track(id) {
    const known = this.byId.get(id), { tracks } = this, t = tracks.id.length;
    if (known !== undefined) return known;
    this.byId.set(id, t);
    tracks.id.push(id);
    tracks.confirmed.push(0);
    tracks.colour.push("#8a8a8a");
    for (const name of ["first", "end", "room"]) tracks[name].push(0);
    if (this.colours.has(id)) this.confirm(t);
    return t;
  }

  confirm(t) {
    const { tracks, colours } = this, id = tracks.id[t], many = this.facts.colours.tracks;
    if (!colours.has(id)) colours.set(id, many[colours.size % many.length]);
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
    const { records, box } = this, count = this.scans.count;
    this.clear();
    this.box = box;
    let scans = 0, from = records.length;
    while (scans < count / 4) scans += records[--from].scans;
    for (const record of records.slice(from)) this.append(record);
  }
}
