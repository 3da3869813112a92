"use strict";
// The columns of the page: unpacked once, then read by all the other scripts and changed by none.

const NUMBERS = {
  f8: Float64Array, f4: Float32Array, u4: Uint32Array, i4: Int32Array, u2: Uint16Array, i2: Int16Array, u1: Uint8Array, i1: Int8Array,
};

function bytesOf(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function unpackColumn(element) {
  const stream = new Blob([bytesOf(element.textContent)]).stream().pipeThrough(new DecompressionStream("deflate"));
  const packed = new Uint8Array(await new Response(stream).arrayBuffer());
  element.textContent = "";
  const kind = NUMBERS[element.dataset.type];
  const size = kind.BYTES_PER_ELEMENT;
  const count = packed.length / size;
  const whole = new Uint8Array(packed.length);
  for (let part = 0; part < size; part++)
    for (let i = 0, from = part * count, to = part; i < count; i++, from++, to += size) whole[to] = packed[from];
  return new kind(whole.buffer);
}

const readFacts = () => JSON.parse(document.getElementById("facts").textContent);

// Returns {facts, scans, returns, tracks, entries, weights, truth} of one of the page's runs: tables of columns, with the
// indices between them.
async function readData(facts, run = 0) {
  const data = { facts };
  for (const table of ["scans", "returns", "tracks", "entries", "weights", "truth"]) data[table] = {};
  const elements = [...document.querySelectorAll(`script.column[data-run="${run}"]`)];
  const values = await Promise.all(elements.map(unpackColumn));
  elements.forEach((element, i) => {
    const [table, name] = element.dataset.name.split(".");
    data[table][name] = values[i];
  });
  data.scans.count = data.scans.time.length;
  data.scans.firstReturn = starts(data.scans.returns);
  data.weights.first = starts(data.weights.count);
  indexTracks(data);
  indexTruth(data);
  return data;
}

// Where each group begins in a table whose groups have these sizes; one more, where the last one ends.
function starts(counts) {
  const first = new Uint32Array(counts.length + 1);
  for (let i = 0; i < counts.length; i++) first[i + 1] = first[i] + counts[i];
  return first;
}

// Rows of groups with the scan's distance from the row before: the scan and the group of each.
function scansAndGroups(counts, gaps) {
  const first = starts(counts), scan = new Uint32Array(gaps.length), group = new Uint32Array(gaps.length);
  for (let g = 0; g < counts.length; g++) {
    for (let row = first[g], at = 0; row < first[g + 1]; row++) {
      at += gaps[row];
      scan[row] = at;
      group[row] = g;
    }
  }
  return { first, scan, group };
}

// Which rows belong to each scan: row[first[s]] to row[first[s + 1] - 1].
function byScan(scan, scans) {
  const counts = new Uint32Array(scans), row = new Uint32Array(scan.length);
  for (const s of scan) counts[s]++;
  const first = starts(counts), next = first.slice();
  for (let i = 0; i < scan.length; i++) row[next[scan[i]]++] = i;
  return { first, row };
}

// The rows of each group, of a table that has them one group after the other.
function rowsOf(first) {
  const all = Uint32Array.from({ length: first[first.length - 1] }, (_, row) => row);
  return Array.from({ length: first.length - 1 }, (_, g) => all.subarray(first[g], first[g + 1]));
}

function indexTracks(data) {
  const { tracks, entries, scans } = data;
  const found = scansAndGroups(tracks.count, entries.gap);
  tracks.rows = rowsOf(found.first);
  entries.scan = found.scan;
  entries.track = found.group;
  entries.atScan = byScan(entries.scan, scans.count);
  tracks.confirmed = new Uint8Array(tracks.id.length);
  tracks.colour = new Array(tracks.id.length);
  let next = 0;
  for (let t = 0; t < tracks.id.length; t++) {
    tracks.confirmed[t] = tracks.rows[t].some((e) => entries.confirmed[e]);
    const colours = data.facts.colours.tracks;
    tracks.colour[t] = tracks.confirmed[t] ? legible(colours[next++ % colours.length]) : THEME.grey;
  }
}

function indexTruth(data) {
  const found = scansAndGroups(data.truth.count, data.truth.gap);
  Object.assign(data.truth, { rows: rowsOf(found.first), scan: found.scan, object: found.group });
  data.truth.atScan = byScan(data.truth.scan, data.scans.count);
}

// Which of a track's rows is that of a scan, or -1.
function placeAt({ entries, tracks }, track, scan) {
  const rows = tracks.rows[track];
  let low = 0, high = rows.length - 1;
  while (low <= high) {
    const middle = (low + high) >> 1, found = entries.scan[rows[middle]];
    if (found === scan) return middle;
    if (found < scan) low = middle + 1;
    else high = middle - 1;
  }
  return -1;
}

// The entry of a track after a scan, or -1.
function entryAt(data, track, scan) {
  const place = placeAt(data, track, scan);
  return place < 0 ? -1 : data.tracks.rows[track][place];
}

// The weights of an entry, the largest first: [{row, weight}], row in the table of returns.
function weightsOf(data, entry) {
  const first = data.scans.firstReturn[data.entries.scan[entry]], found = [];
  for (let w = data.weights.first[entry], end = w + data.weights.count[entry]; w < end; w++)
    found.push({ row: first + data.weights.return[w], weight: data.weights.weight[w] });
  return found;
}

const counted = (count, what) => `${count} ${what}${count === 1 ? "" : "s"}`;

// A number with four significant digits, a dash where there is none.
function shown(value) {
  if (value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(4))) : value.toExponential(3);
}

// When a scan was: the date where times are dates, and s from the first scan.
function clockOf({ scans, facts }, scan) {
  const since = `${(scans.time[scan] - scans.time[0]).toFixed(2)} s`;
  return facts.dated ? `${dateOf(scans.time[scan])} (${since})` : since;
}

// A date and time of s since 1970 by ISO 8601, to the millisecond.
function dateOf(time) {
  const date = new Date(1000 * time);
  return Number.isNaN(date.getTime()) ? shown(time) : date.toISOString();
}

// A coordinate on the map, with its centre added.
function shownPlace(data, value, axis) {
  return Number.isFinite(value) ? (value + data.facts.centre[axis]).toFixed(data.facts.unit === "m" ? 1 : 2) : "–";
}
