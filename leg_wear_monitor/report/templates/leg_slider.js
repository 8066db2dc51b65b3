"use strict";
// A mechanism at a crank angle, by a slider: bodies, joints, path of the toe, open joints.
(function () {
  const root = document.getElementById("leg-slider");
  const data = JSON.parse(root.querySelector(".data").textContent);
  const INK = "var(--ink)", VERMILION = "var(--vermilion)", PAPER = "var(--paper)";
  const svg = root.querySelector(".leg"), slider = root.querySelector("input"), angle = root.querySelector(".angle");
  const play = root.querySelector(".play"), said = root.querySelector(".said");
  const unit = Math.max(data.box[3], 0.6 * data.box[2]) / 100;  // a hundredth of the picture's height

  function add(parent, name, attributes, text) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  }
  function line(points, closed) {
    return "M" + points.map((p) => p[0] + " " + p[1]).join("L") + (closed ? "Z" : "");
  }

  if (data.toe.length) {
    add(svg, "path", { d: line(data.toe, data.turns), fill: "none", stroke: INK, "stroke-width": 0.5 * unit, "stroke-dasharray": 1.5 * unit });
  }
  const bodies = data.bodies.map((body) => {
    const group = add(svg, "g", {});
    const path = line(body.outline, body.outline.length > 2), joins = { "stroke-linejoin": "round", "stroke-linecap": "round" };
    add(group, "path", { d: path, fill: body.colour, stroke: body.colour, "stroke-width": 3 * unit, ...joins });
    add(group, "path", { d: path, fill: PAPER, stroke: PAPER, "stroke-width": 2.2 * unit, opacity: 0.62, ...joins });
    return { poses: body.poses, group: group };
  });
  const joints = {};
  data.joints.forEach((joint, i) => {
    const twin = data.joints.slice(0, i).some((o) => Math.hypot(o.path[0][0] - joint.path[0][0], o.path[0][1] - joint.path[0][1]) < 1);
    const group = add(svg, "g", {}), colour = joint.other ? VERMILION : INK;
    if (joint.ground) add(group, "path", { d: "M0 0L" + -2 * unit + " " + 3.4 * unit + "H" + 2 * unit + "Z", fill: "#8a8a8a" });
    add(group, "circle", { r: 1.1 * unit, fill: PAPER, stroke: colour, "stroke-width": 0.5 * unit });
    const letter = add(group, "text", {
      "text-anchor": "middle", "font-size": 4 * unit, "font-weight": 700, fill: colour,
      stroke: PAPER, "stroke-width": 0.9 * unit, "paint-order": "stroke", "font-family": "sans-serif"
    }, joint.name);
    joints[joint.name] = { path: joint.path, group: group, letter: letter, twin: twin };
    if (joint.other) {
      joints[joint.name].open = joint;
      joints[joint.name].gap = add(svg, "path", { fill: "none", stroke: VERMILION, "stroke-width": 0.9 * unit, "stroke-dasharray": 1.6 * unit });
      joints[joint.name].end = add(svg, "circle", { r: 1.1 * unit, fill: PAPER, stroke: VERMILION, "stroke-width": 0.6 * unit });
    }
  });
  // A letter stands on the side of its joint that is away from the joints near it.
  function placeLetter(joint, index) {
    const here = joint.path[index];
    let dx = 0.001, dy = -0.3;
    for (const name in joints) {
      const there = joints[name].path[index], x = here[0] - there[0], y = here[1] - there[1], far = Math.hypot(x, y);
      if (far > 1 && far < 25 * unit) {
        dx += (x / far) * (1 - far / (25 * unit));
        dy += (y / far) * (1 - far / (25 * unit));
      }
    }
    const size = Math.hypot(dx, dy);
    joint.letter.setAttribute("x", (3.6 * dx / size + (joint.twin ? 3 : 0)) * unit);
    joint.letter.setAttribute("y", (3.6 * dy / size + 1.4) * unit);
  }

  let frame = 0, timer = null;

  function show(index) {
    frame = index;
    if (slider) {
      const degrees = Number(data.angles[index].toFixed(1));
      slider.value = index;
      angle.textContent = degrees + "°";
      slider.setAttribute("aria-valuetext", degrees + " degrees");
    }
    const words = [];
    bodies.forEach((body) => {
      const pose = body.poses[index];
      body.group.setAttribute("transform", "translate(" + pose[0] + " " + pose[1] + ") rotate(" + pose[2] + ")");
    });
    for (const name in joints) {
      const place = joints[name].path[index];
      joints[name].group.setAttribute("transform", "translate(" + place[0] + " " + place[1] + ")");
      placeLetter(joints[name], index);
      const open = joints[name].open;
      if (open) {
        joints[name].gap.setAttribute("d", line([place, open.other[index]], false));
        joints[name].end.setAttribute("cx", open.other[index][0]);
        joints[name].end.setAttribute("cy", open.other[index][1]);
        words.push("Joint " + name + " is open by " + open.gap_mm[index] + " mm.");
      }
    }
    if (data.said[index]) words.push(data.said[index]);
    said.textContent = words.join(" ");
    root.dataset.frame = index;
  }

  // A crank that does not turn through goes to and fro.
  let way = 1;
  function next() {
    if (data.turns) return (frame + 1) % data.frames;
    if (frame + way < 0 || frame + way >= data.frames) way = -way;
    return frame + way;
  }

  if (Object.keys(data.said).length || data.joints.some((joint) => joint.other)) said.hidden = false;
  if (slider) {
    slider.addEventListener("input", () => show(Number(slider.value)));
    play.addEventListener("click", () => {
      if (timer === null) {
        timer = setInterval(() => show(next()), 45);
      } else {
        clearInterval(timer);
        timer = null;
      }
      play.textContent = timer === null ? "Play" : "Pause";
      play.setAttribute("aria-pressed", String(timer !== null));
    });
  }
  show(data.first);
})();
