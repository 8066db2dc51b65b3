"use strict";
// Draws each chart of the page from the CSV file in its link, with uPlot.
(function () {
  const NARROW = 560, PRINTED = 660;  // widths [px]
  const charts = [];  // {plots, box}
  const groups = {};  // plots that share cursor and zoom
  let zooming = false;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // four digits, for the values under the pointer
  const short = (value) => String(Number(value.toPrecision(4)));

  const decimals = (step) => (String(Number(step.toPrecision(3))).split(".")[1] || "").length;

  function columnsOf(link) {
    const href = link.getAttribute("href"), text = decodeURIComponent(href.slice(href.indexOf(",") + 1));
    const rows = text.trimEnd().split("\n").slice(1).map((row) => row.split(","));
    const width = rows.length ? rows[0].length : 0;
    return Array.from({ length: width }, (_, k) => rows.map((row) => (row[k] === "" ? null : Number(row[k]))));
  }

  function seriesOf(panel) {
    return panel.series.map((series, k) => {
      const points = series.style === "points";
      const isEdge = series.style === "edge";
      const drawn = { label: series.name, stroke: () => colour(series.colour), width: points || isEdge ? 0 : series.width };
      if (series.style === "dashed") drawn.dash = [6, 4];
      if (points) drawn.paths = () => null;
      drawn.points = { show: points ? true : isEdge ? false : undefined, size: points ? 9 : 5 };
      drawn.value = (_, value) => {
        if (value === null || value === undefined) return "–";
        return short(value) + (series.unit ? " " + series.unit : "");
      };
      return drawn;
    });
  }

  function yAxis(panel, narrow) {
    const axis = { stroke: () => colour("--ink"), grid: { stroke: () => colour("--pale"), width: 1 }, ticks: { show: false } };
    axis.size = narrow ? 52 : 64;
    axis.values = (_, values, k, space, step) =>
      values.map((value) => (value === null ? "" : step < 1e-6 ? short(value) : value.toFixed(decimals(step))));
    return axis;
  }

  function rangeOf(panel) {
    return (_, low, high) => {
      const own = uPlot.rangeNum(low === null ? 0 : low, high === null ? 1 : high, 0.1, true);
      return [panel.low === null ? own[0] : panel.low, panel.high === null ? own[1] : panel.high];
    };
  }

  function share(plot, group) {  // a zoom of one is the zoom of all
    if (zooming) return;
    zooming = true;
    const scale = plot.scales.x;
    groups[group].forEach((other) => {
      if (other !== plot) other.setScale("x", { min: scale.min, max: scale.max });
    });
    zooming = false;
  }

  function settingsOf(chart, panel, width) {
    return {
      title: panel.title + (panel.series[0].unit ? " [" + panel.series[0].unit + "]" : ""),
      width: width,
      height: panel.height,
      cursor: { sync: { key: chart.group }, drag: { x: true, y: false } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: rangeOf(panel) } },
      series: [{ label: chart.x, value: (_, value) => (value === null ? "–" : short(value)) }].concat(seriesOf(panel)),
      bands: panel.bands.map((band) => ({ series: band.map((k) => k + 1), fill: () => colour(panel.series[band[0]].colour) + "40" })),
      axes: [
        { stroke: () => colour("--ink"), grid: { stroke: () => colour("--pale"), width: 1 }, ticks: { show: false }, size: 34 },
        yAxis(panel, width < NARROW)
      ],
      hooks: {
        setScale: [(plot, key) => { if (key === "x" && plot.status) share(plot, chart.group); }]
      }
    };
  }

  function reset(plot) {
    const x = plot.data[0];
    plot.setScale("x", { min: plot.ends ? plot.ends[0] : x[0], max: plot.ends ? plot.ends[1] : x[x.length - 1] });
  }

  function zoom(plot, factor) {
    const scale = plot.scales.x, index = plot.cursor.idx;
    const middle = index === null || index === undefined ? (scale.min + scale.max) / 2 : plot.data[0][index];
    plot.setScale("x", { min: middle - (middle - scale.min) * factor, max: middle + (scale.max - middle) * factor });
  }

  function onKey(event, plot) {
    const x = plot.data[0], now = plot.cursor.idx === null || plot.cursor.idx === undefined ? -1 : plot.cursor.idx;
    const places = { ArrowRight: now + 1, ArrowLeft: now - 1, Home: 0, End: x.length - 1 };
    if (event.key in places) {
      const place = Math.min(Math.max(places[event.key], 0), x.length - 1);
      plot.setCursor({ left: plot.valToPos(x[place], "x"), top: plot.over.clientHeight / 2 });
    } else if (event.key === "+") zoom(plot, 0.5);
    else if (event.key === "-") zoom(plot, 2);
    else if (event.key === "0" || event.key === "Escape") reset(plot);
    else return;
    event.preventDefault();
  }

  function reachable(plot, panel) {
    const root = plot.root, legend = root.querySelector(".u-legend");
    root.tabIndex = 0;
    root.setAttribute("role", "group");
    root.setAttribute("aria-label", panel.title + ": arrow keys show the values, + and - zoom, 0 shows all");
    root.addEventListener("keydown", (event) => onKey(event, plot));
    root.addEventListener("focus", () => legend.setAttribute("aria-live", "polite"));
    root.addEventListener("blur", () => legend.removeAttribute("aria-live"));
  }

  function draw(figure) {
    const box = figure.querySelector(".plots");
    if (box.firstChild || !box.clientWidth) return;
    const chart = JSON.parse(figure.querySelector("script").textContent);
    const columns = columnsOf(figure.querySelector("a[download]"));
    if (!columns.length) return;
    let first = 1;
    const plots = chart.panels.map((panel) => {
      const own = columns.slice(first, (first += panel.series.length));
      const data = [columns[0]].concat(own);
      const plot = new uPlot(settingsOf(chart, panel, box.clientWidth), data, box);
      plot.ends = chart.ends;
      reset(plot);
      plot.over.addEventListener("dblclick", () => reset(plot));
      reachable(plot, panel);
      (groups[chart.group] = groups[chart.group] || []).push(plot);
      return plot;
    });
    figure.querySelector("button").addEventListener("click", () => reset(plots[0]));
    charts.push({ plots: plots, box: box });
  }

  const drawAll = () => document.querySelectorAll("figure.chart").forEach(draw);
  const resize = (width) => charts.forEach((chart) => chart.plots.forEach((plot) =>
    plot.setSize({ width: width || chart.box.clientWidth || plot.width, height: plot.height })));
  const redraw = () => charts.forEach((chart) => chart.plots.forEach((plot) => {
    plot.root.querySelectorAll(".u-marker").forEach((marker, k) => {
      if (k) marker.style.borderColor = plot.series[k].stroke(plot, k);
    });
    plot.redraw(false);
  }));

  // Markup was replaced: forget the charts that are gone, and draw the new ones.
  document.addEventListener("replaced", () => {
    const isThere = (plot) => plot.root.isConnected || plot.destroy();
    Object.keys(groups).forEach((group) => { groups[group] = groups[group].filter(isThere); });
    charts.splice(0, charts.length, ...charts.filter((chart) => chart.box.isConnected));
    drawAll();
  });

  function unfold() {  // what a link leads to is open
    const there = location.hash && document.getElementById(location.hash.slice(1));
    if (there && there.matches("details")) there.open = true;
  }
  window.addEventListener("hashchange", unfold);
  document.addEventListener("click", (event) => { if (event.target.closest('a[href^="#"]')) setTimeout(unfold); });
  unfold();

  document.addEventListener("shown", drawAll);  // what was hidden

  const folded = Array.from(document.querySelectorAll("details"));
  folded.forEach((details) => details.addEventListener("toggle", drawAll));
  window.addEventListener("resize", () => resize(0));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  window.addEventListener("beforeprint", () => {  // on paper, in the light colours
    document.documentElement.dataset.printed = "";
    drawAll();
    resize(PRINTED);
    redraw();
  });
  window.addEventListener("afterprint", () => {
    delete document.documentElement.dataset.printed;
    resize(0);
    redraw();
  });
  drawAll();
})();
