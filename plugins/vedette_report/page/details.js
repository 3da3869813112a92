"use strict";
// What is told of the track or the return that was picked, after the scan that is shown.

function element(name, text = "", className = "") {
  const made = document.createElement(name);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}

const LISTED = 40;  // confirmed tracks of a scan that are listed; the map has all

class Details {
  constructor(data, state, host, choose) {
    Object.assign(this, { data, state, host, choose });
  }

  show() {
    const { state } = this;
    if (state.track >= 0) this.showTrack(state.track);
    else if (state.return >= 0) this.showReturn(state.return);
    else this.showScan();
  }

  table(rows) {
    const table = element("table");
    for (const [name, value, key] of rows) {
      const row = table.insertRow(), cell = element("td", value);
      if (key) cell.dataset.value = key;
      row.append(element("th", name), cell);
    }
    return table;
  }

  // Rows of the columns that have a value anywhere.
  known(table, at, titles) {
    this.empty ??= {};
    const { data, empty } = this, lacks = (name) => empty[name] ??= !data[table][name].some(Number.isFinite);
    return titles.filter(([, name]) => data.facts.live || !lacks(name)).map(([title, name]) => [title, shown(data[table][name][at]), name]);
  }

  // A table whose rows can be picked.
  list(head, rows) {
    const table = element("table", "", "list"), top = table.createTHead().insertRow(), body = table.createTBody();
    head.forEach((text) => top.append(element("th", text)));
    for (const { cells, pick } of rows) {
      const row = body.insertRow();
      cells.forEach((text) => row.append(element("td", text)));
      row.tabIndex = 0;
      row.addEventListener("click", pick);
      row.addEventListener("keydown", (event) => { if (event.key === "Enter") pick(); });
    }
    return table;
  }

  showScan() {
    const { data, state, host } = this, { scans, entries, tracks, facts } = data, s = state.scan;
    const rows = [], judged = facts.objects.length > 0, heads = judged ? ["object", "error"] : [];
    for (let k = entries.atScan.first[s]; k < entries.atScan.first[s + 1]; k++) {
      const e = entries.atScan.row[k], t = entries.track[e];
      if (entries.confirmed[e]) rows.push({ entry: e, pick: () => this.choose({ track: t }) });
    }
    for (const row of rows.slice(0, LISTED)) {
      const e = row.entry;
      const compared = judged ? [this.objectOf(e), shown(entries.position_error[e])] : [];
      row.cells = [String(tracks.id[entries.track[e]]), ...compared, shown(entries.existence[e])];
    }
    host.replaceChildren(
      element("h2", `Scan ${s + 1} of ${scans.count}`),
      this.table([
        facts.dated ? ["time", dateOf(scans.time[s]), "time"] : ["time [s]", scans.time[s].toFixed(3), "time"],
        ["sensor", Object.keys(facts.sensors)[scans.sensor[s]]],
        ["returns", String(scans.returns[s]), "returns"],
        ...this.known("scans", s, [...(judged ? [["objects covered", "covered"]] : []), [`position error [${facts.unit}]`, "position_rmse"], ["NEES", "nees"], ["NIS", "nis"]]),
      ]),
      element("h3", rows.length ? "Confirmed tracks" : "No confirmed track"),
    );
    if (rows.length) host.append(this.list(["track", ...heads, "existence"], rows.slice(0, LISTED)));
    if (rows.length > LISTED) host.append(element("p", `and ${rows.length - LISTED} more on the map`, "hint"));
    host.append(element("p", "Click a track or a return on the map.", "hint"));
  }

  objectOf(e) {
    const object = this.data.entries.object[e];
    return object < 0 ? "–" : this.data.facts.objects[object];
  }

  // The heading of what was picked, with a button that lets it go.
  title(text, colour) {
    const head = element("h2"), mark = element("span", "", "mark"), close = element("button", "×");
    mark.style.background = colour;
    close.type = "button";
    close.title = "Let go";
    close.addEventListener("click", () => this.choose({}));
    head.append(mark, text, close);
    return head;
  }

  showTrack(t) {
    const { data, state, host } = this, { entries, tracks, facts, scans } = data, e = entryAt(data, t, state.scan);
    const own = tracks.rows[t], first = entries.scan[own[0]], last = entries.scan[own[own.length - 1]];
    host.replaceChildren(this.title(`Track ${tracks.id[t]}`, tracks.colour[t]));
    host.firstChild.id = "chosen";
    host.append(element("p", `scans ${first + 1} to ${last + 1}, ${(scans.time[first] - scans.time[0]).toFixed(2)} s to ${(scans.time[last] - scans.time[0]).toFixed(2)} s from the first`, "hint"));
    if (e < 0) {
      host.append(element("p", "It does not exist at this scan."));
      return;
    }
    const rows = [["status", entries.confirmed[e] ? "confirmed" : "tentative"]];
    if (facts.objects.length) rows.push(["object", this.objectOf(e), "object"]);
    if (entries.x)
      rows.push(...[0, 1].map((i) => [facts.map.labels[i], `${shownPlace(data, [entries.x, entries.y][i][e], i)} ± ${shown(Math.sqrt([entries.covXX, entries.covYY][i][e]))}`, ["x", "y"][i]]));
    if (entries.vx) rows.push([`speed [${facts.unit}/s]`, shown(Math.hypot(entries.vx[e], entries.vy[e])), "speed"]);
    rows.push(...this.known("entries", e, [
      [`error [${facts.unit}]`, "position_error"], [`expected RMS [${facts.unit}]`, "position_sigma"], ["NEES", "nees"],
      ["NIS given a hit", "nis_given_hit"], ["existence", "existence"],
    ]));
    if (entries.link) rows.push(...this.known("entries", e, [["this return and its last are of one target", "link"]]));
    facts.modes.forEach((name, i) => rows.push([name, shown(entries[`mode${i}`][e]), `mode${i}`]));
    host.append(this.table(rows), element("h3", "Whose return?"), this.weights(e));
  }

  weights(e) {
    const { data } = this, found = weightsOf(data, e);
    const rows = found.map(({ row, weight }) => ({
      cells: [`return ${row - data.scans.firstReturn[data.entries.scan[e]]}`, shown(weight)],
      pick: () => this.choose({ return: row }),
    }));
    rows.push({ cells: ["none: a miss", shown(data.entries.miss[e])], pick: () => {} });
    const table = this.list(["of this scan", "probability"], rows);
    table.id = "weights";
    return table;
  }

  showReturn(r) {
    const { data, state, host } = this, { entries, returns, scans, tracks, facts } = data, s = state.scan;
    host.replaceChildren(this.title(`Return ${r - scans.firstReturn[s]}`, THEME.accent));
    host.firstChild.id = "chosen";
    const rows = [["sensor", Object.keys(facts.sensors)[scans.sensor[s]]]];
    if (facts.map && Number.isFinite(returns.x[r]))
      rows.push(...[0, 1].map((i) => [facts.map.labels[i], shownPlace(data, [returns.x, returns.y][i][r], i), ["x", "y"][i]]));
    const owners = [];
    for (let k = entries.atScan.first[s]; k < entries.atScan.first[s + 1]; k++) {
      const e = entries.atScan.row[k], own = weightsOf(data, e).find(({ row }) => row === r);
      if (own) owners.push({ weight: own.weight, cells: [`track ${tracks.id[entries.track[e]]}`, shown(own.weight)], pick: () => this.choose({ track: entries.track[e] }) });
    }
    owners.sort((a, b) => b.weight - a.weight);
    host.append(this.table(rows), element("h3", owners.length ? "Whose was it?" : "No track's, with more than .01"));
    if (owners.length) host.append(this.list(["track", "probability"], owners));
  }
}
