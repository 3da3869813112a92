"use strict";
// The page of a study: its curves, its tables, and its worst runs.

const facts = JSON.parse(document.getElementById("facts").textContent), byId = (id) => document.getElementById(id);

function element(name, text = "", className = "") {
  const made = document.createElement(name);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}

// A figure with as many digits as its error knows.
function told([value, error]) {
  if (value === null) return "–";
  if (!error) return String(Number(value.toPrecision(4)));
  const places = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(error))));
  return `${value.toFixed(places)} ± ${error.toFixed(places)}`;
}

function showCharts() {
  for (const chart of facts.charts) {
    const group = element("div", "", "chart-group");
    group.append(labelsOf(chart.panels[0].curves));
    for (const panel of chart.panels) {
      const frame = element("figure"), title = element("figcaption", panel.upright);
      if (panel.title) title.append(element("small", ` ${panel.title}`));
      frame.dataset.panel = `${chart.name}: ${panel.upright}`;
      frame.append(title, plotOf(panel));
      group.append(frame);
    }
    byId("plots").append(group);
  }
}

function showTables() {
  for (const { title, columns, rows } of facts.tables) {
    const box = element("div", "", "scroll"), table = element("table", "", "figures"), top = table.createTHead().insertRow(), body = table.createTBody();
    top.append(element("td"), ...columns.map((name) => element("th", name)));
    for (const [label, cells] of rows) body.insertRow().append(element("th", label), ...cells.map((cell) => element("td", told(cell))));
    box.append(table);
    byId("tables").append(element("h2", title), box);
  }
  if (facts.tables.length) byId("tables").prepend(element("p", "± is one Monte-Carlo standard error", "hint"));
}

// A command that a click selects and copies.
function commandOf(text) {
  const box = element("input", "", "command");
  box.value = text;
  box.readOnly = true;
  box.setAttribute("aria-label", "Command");
  box.addEventListener("click", () => { box.select(); document.execCommand("copy"); });
  return box;
}

function showWorst() {
  const host = byId("worst");
  if (!facts.judged) return;
  const [name, unit] = facts.judged, words = unit === "1" ? name : `${name} [${unit}]`;
  host.append(element("h2", `The worst runs by ${words}`), element("p", "Each can be run anew with its own seed, for its page: a click on a command copies it. All of them:", "hint"), commandOf(facts.command));
  for (const point of facts.worst) {
    host.append(element("h3", point.name));
    const box = element("div", "", "scroll"), table = element("table", "", "runs"), body = table.createTBody();
    for (const { run, value, command, page } of point.runs) {
      const row = body.insertRow(), cell = element("td");
      if (page) {
        const link = element("a", "its page");
        link.href = page;
        cell.append(link);
      } else cell.append(commandOf(command));
      row.append(element("th", `run ${run}`), element("td", value === null ? "no track" : String(Number(value.toPrecision(4)))), cell);
    }
    box.append(table);
    host.append(box);
  }
}

for (const { panels } of facts.charts) for (const { curves } of panels) for (const curve of curves) curve.colour = legible(curve.colour);
showCharts();
showTables();
showWorst();
byId("words").textContent = facts.words;
document.documentElement.dataset.ready = String(Math.round(performance.now()));
