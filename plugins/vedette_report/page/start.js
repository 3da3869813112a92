"use strict";
// Opens the page of one run.

readData(readFacts()).then((data) => {
  if (data.scans.count) window.page = new Page(data);
  else byId("overview").textContent = "The run took no scan.";
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
});
