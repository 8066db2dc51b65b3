"use strict";
// Drive torque over the crank angle: cycles as measured, the prediction, and the band in which no alarm is raised.
(function () {
  const WIDTH = 640, HEIGHT = 230, LEFT = 52, RIGHT = 8, TOP = 10, BOTTOM = 40, MOST = 10;
  const NAMES = { path: ["class", "d"], line: ["class", "x1", "y1", "x2", "y2"], text: ["class", "x", "y"] };

  function add(parent, name, values, text) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    NAMES[name].forEach((key, k) => element.setAttribute(key, values[k]));
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
  }

  // Cycles: {measured_nm, predicted_nm} each, the last one is the newest. Phase: that of the crank, if it is marked.
  function draw(svg, cycles, limit, phase) {
    while (svg.firstChild) svg.removeChild(svg.firstChild);
    if (!cycles.length) return;
    const newest = cycles[cycles.length - 1], phases = newest.predicted_nm.length;
    const mean = newest.predicted_nm.map((_, k) => {
      const known = cycles.map((cycle) => cycle.predicted_nm[k]).filter((value) => value !== null);
      return known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
    });
    const known = mean.filter((value) => value !== null);
    const half = limit * Math.sqrt(known.reduce((sum, value) => sum + value * value, 0) / (known.length || 1));
    const all = cycles.flatMap((cycle) => cycle.measured_nm).concat(known.map((v) => v + half), known.map((v) => v - half)).filter((v) => v !== null);
    const low = Math.min(0, ...all), high = Math.max(0, ...all), span = high - low || 1;
    const x = (k) => LEFT + (WIDTH - LEFT - RIGHT) * (k + 0.5) / phases;
    const y = (value) => TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / span;
    const path = (values) => {
      let pen = "M", text = "";
      values.forEach((value, k) => {
        text += value === null ? "" : pen + x(k).toFixed(1) + " " + y(value).toFixed(1);
        pen = value === null ? "M" : "L";
      });
      return text;
    };
    const step = [1, 2, 5, 10, 20, 50, 100, 200, 500].find((each) => span / each <= 6) || 1000;
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      add(svg, "line", ["grid", LEFT, y(value), WIDTH - RIGHT, y(value)]);
      add(svg, "text", ["tick end", LEFT - 6, y(value) + 4], String(value));
    }
    for (let angle = 0; angle <= 360; angle += 90) {
      add(svg, "text", ["tick middle", LEFT + (WIDTH - LEFT - RIGHT) * angle / 360 - (angle === 360 ? 8 : 0), HEIGHT - 24], angle + "°");
    }
    add(svg, "text", ["tick middle", (LEFT + WIDTH) / 2, HEIGHT - 4], "crank angle");
    const there = mean.map((value, k) => [k, value]).filter((each) => each[1] !== null);
    const edge = (points, sign) => points.map(([k, value]) => x(k).toFixed(1) + " " + y(value + sign * half).toFixed(1));
    add(svg, "path", ["band", "M" + edge(there, 1).concat(edge(there.reverse(), -1)).join("L") + "Z"]);
    cycles.forEach((cycle, k) => add(svg, "path", [k === cycles.length - 1 ? "measured newest" : "measured", path(cycle.measured_nm)]));
    add(svg, "path", ["predicted", path(mean)]);
    if (phase !== undefined) add(svg, "line", ["now", x(phase), TOP, x(phase), HEIGHT - BOTTOM]);
    svg.setAttribute("aria-label", "Drive torque over the crank angle, " + cycles.length + (cycles.length > 1 ? " gait cycles" : " gait cycle"));
  }

  window.torquePhase = { draw: draw, most: MOST };
})();
