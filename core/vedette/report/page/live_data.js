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
    for (const table in this.columns) {
      this[table] = {};
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
    if (table === "entries") Object.assign(this.weights || {}, { first: this.entries.firstWeight, count: this.entries.weightCount });
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

  // The rows come track by track, each with its distance in scans from the one before.
  addEntries(record, before) {
    const { entries, tracks } = this, columns = this.columns.entries.filter(({ sent }) => sent);
    const ids = record["tracks.id"], counts = record["weights.count"];
    const { scan, group } = scansAndGroups(record["tracks.count"], record["entries.gap"]), slots = this.slots(entries, scan, record.scans);
    let weight = this.used.weights - record["weights.weight"].length;
    for (let i = 0; i < scan.length; i++) {
      const t = this.track(ids[group[i]]), e = this.place("entries", tracks, t, slots[i]);
      for (const { name, sent } of columns) entries[name][e] = record[sent][i];
      entries.scan[e] = before + scan[i];
      entries.track[e] = t;
      entries.firstWeight[e] = weight;
      entries.weightCount[e] = counts[i];
      weight += counts[i];
      if (entries.confirmed[e] && !tracks.confirmed[t]) this.confirm(t);
      if (entries.x && entries.confirmed[e] && entries.miss[e] < 0.5) this.extend(entries.x[e], entries.y[e]);
    }
  }

  addTruth(record, before) {
    const { truth } = this, { scan, group } = scansAndGroups(record["truth.count"], record["truth.gap"]);
    const slots = this.slots(truth, scan, record.scans);
    for (let i = 0; i < scan.length; i++) {
      const row = this.place("truth", truth, group[i], slots[i]);
      truth.scan[row] = before + scan[i];
      truth.object[row] = group[i];
      truth.x[row] = record["truth.x"][i];
      truth.y[row] = record["truth.y"][i];
      this.extend(truth.x[row], truth.y[row]);
    }
  }

  // Where rows of the next scans stand in the list of each scan's rows.
  slots({ atScan }, scan, scans) {
    const begin = atScan.row.length, { first, row } = byScan(scan, scans), slots = new Uint32Array(scan.length);
    row.forEach((i, slot) => { slots[i] = begin + slot; });
    for (let s = 0; s < scans; s++) atScan.first.push(begin + first[s + 1]);
    for (let i = 0; i < scan.length; i++) atScan.row.push(0);
    return slots;
  }

  // A new row at the end of a group's. Where the group has no room left, it moves to the end of the table.
  place(name, groups, g, slot) {
    const table = this[name];
    if (groups.end[g] - groups.first[g] === groups.room[g]) {
      const first = this.used[name], size = groups.end[g] - groups.first[g], room = Math.max(ROOM, 2 * groups.room[g]);
      this.grow(name, first + room);
      for (const column of this.columns[name]) table[column.name].copyWithin(first, groups.first[g], groups.end[g]);
      for (let i = first; i < first + size; i++) table.atScan.row[table.slot[i]] = i;
      this.used[name] += room;
      groups.first[g] = first;
      groups.end[g] = first + size;
      groups.room[g] = room;
    }
    const row = groups.end[g]++;
    table.slot[row] = slot;
    table.atScan.row[slot] = row;
    return row;
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
