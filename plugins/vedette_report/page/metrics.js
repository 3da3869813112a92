"use strict";
// The figures of runs as tables: a column a run, and from the second run on its difference to the first.

function metricsTables(metrics, names) {
  const heads = ["", ...names.flatMap((name, i) => i ? [name, "difference"] : [name])];
  const cells = (values) => values.flatMap((value, i) => i ? [shown(value), difference(values[0], value)] : [shown(value)]);
  const tables = [figureTable(heads, metrics.rows.map(({ name, about, unit, values }) => [unit ? `${about} [${unit}]` : about, name, cells(values)]))];
  const named = Object.entries(metrics.of_objects).filter(([name]) => metrics.objects.some((object) => object[name].some((value) => value !== null)));
  const title = ([, [about, unit]]) => unit ? `${about} [${unit}]` : about;
  const row = (object, columns) => [object.name, object.name, columns.flatMap(([name]) => cells(object[name]))];
  const ofAll = names.length > 1 ? named.map((column) => [column]) : [named];  // a table a figure, or one of all figures
  for (const columns of ofAll.filter((each) => each.length))
    tables.push(figureTable(names.length > 1 ? [title(columns[0]), ...heads.slice(1)] : ["", ...columns.map(title)], metrics.objects.map((object) => row(object, columns))));
  return tables;
}

function difference(first, value) {
  if (first === null || value === null) return "–";
  const text = shown(value - first);
  return value > first ? `+${text}` : text.replace("-", "−");
}

function figureTable(heads, rows) {
  const table = element("table", "", "figures"), top = table.createTHead().insertRow(), body = table.createTBody();
  heads.forEach((text) => top.append(element(text ? "th" : "td", text)));
  for (const [about, name, cells] of rows) {
    const row = body.insertRow();
    row.dataset.figure = name;
    row.append(element("th", about), ...cells.map((text) => element("td", text)));
  }
  return table;
}
