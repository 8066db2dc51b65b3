"use strict";
// The leg at a crank angle, its pins in their bushings, forces and impacts: by a slider, or as frames come (root.live).
(function () {
  function begin() {
  const root = document.getElementById("leg-slider");
  if (!root || root.dataset.frame) return;
  const data = JSON.parse(root.querySelector(".data").textContent);
  const INK = "var(--ink)", VERMILION = "var(--vermilion)", BLUE = "var(--blue)", PALE = "var(--pale)", PAPER = "var(--paper)";
  const BUSHING = 46, USUAL_GAP = 0.3 * BUSHING, TRAIL = 60;  // as drawn; places of a pin that are kept
  const svg = root.querySelector(".leg"), pins = root.querySelector(".pins");
  const slider = root.querySelector("input"), angle = root.querySelector(".angle");
  const play = root.querySelector(".play"), choice = root.querySelector(".run");
  const said = root.querySelector(".said");
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
  const arrows = add(svg, "g", {});
  const joints = {};
  data.joints.forEach((joint, i) => {
    const twin = data.joints.slice(0, i).some((o) => Math.hypot(o.path[0][0] - joint.path[0][0], o.path[0][1] - joint.path[0][1]) < 1);
    const group = add(svg, "g", {});
    if (joint.ground) add(group, "path", { d: "M0 0L" + -2 * unit + " " + 3.4 * unit + "H" + 2 * unit + "Z", fill: "#8a8a8a" });
    const mark = add(group, "circle", { r: 1.1 * unit, fill: PAPER, stroke: INK, "stroke-width": 0.4 * unit });
    const letter = add(group, "text", {
      "text-anchor": "middle", "font-size": 4 * unit, "font-weight": 700, fill: INK,
      stroke: PAPER, "stroke-width": 0.9 * unit, "paint-order": "stroke", "font-family": "sans-serif"
    }, joint.name);
    joints[joint.name] = { path: joint.path, group: group, mark: mark, letter: letter, twin: twin };
    if (joint.other) {
      joints[joint.name].open = joint;
      joints[joint.name].gap = add(svg, "path", { fill: "none", stroke: VERMILION, "stroke-width": 0.9 * unit, "stroke-dasharray": 1.6 * unit });
      joints[joint.name].end = add(svg, "circle", { r: 1.1 * unit, fill: PAPER, stroke: VERMILION, "stroke-width": 0.6 * unit });
    }
  });
  const inLine = data.marks.map((mark) => ({
    frame: mark.frame,
    path: add(svg, "path", { d: line(mark.line, false), fill: "none", stroke: VERMILION, "stroke-width": 0.9 * unit, "stroke-dasharray": 2 * unit })
  }));
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

  let run, parts, frame = 0, timer = null;

  function arrow(group, x, y, fx, fy, length, width) {
    while (group.firstChild) group.removeChild(group.firstChild);
    const size = Math.hypot(fx, fy);
    if (size < 0.05) return;
    const ux = fx / size, uy = fy / size, ex = x + ux * length, ey = y + uy * length, head = 3.2 * width;
    add(group, "line", { x1: x, y1: y, x2: ex, y2: ey, stroke: VERMILION, "stroke-width": width });
    add(group, "path", {
      d: line([[ex + ux * head, ey + uy * head], [ex - uy * head * 0.6, ey + ux * head * 0.6], [ex + uy * head * 0.6, ey - ux * head * 0.6]], true),
      fill: VERMILION
    });
  }

  // A star of rays where an impact is; larger for a harder one.
  function spark(group, x, y, size) {
    while (group.firstChild) group.removeChild(group.firstChild);
    if (!size) return;
    const rays = [];
    for (let k = 0; k < 8; k += 1) {
      const turn = k * Math.PI / 4 + 0.3, far = size * (k % 2 ? 0.75 : 1);
      rays.push("M" + (x + 0.45 * size * Math.cos(turn)) + " " + (y + 0.45 * size * Math.sin(turn)) + "L" + (x + far * Math.cos(turn)) + " " + (y + far * Math.sin(turn)));
    }
    add(group, "path", { d: rays.join(""), class: "spark", "stroke-width": 0.09 * size });
  }

  function choose(index) {
    run = data.runs[index] || { pins: {} };
    while (pins.firstChild) pins.removeChild(pins.firstChild);
    while (arrows.firstChild) arrows.removeChild(arrows.firstChild);
    for (const name in joints) {
      const loose = name in run.pins && run.pins[name].e || joints[name].open;
      joints[name].mark.setAttribute("stroke", loose ? VERMILION : INK);
      joints[name].mark.setAttribute("stroke-width", (loose ? 0.8 : 0.4) * unit);
      joints[name].letter.setAttribute("fill", loose ? VERMILION : INK);
    }
    parts = Object.keys(run.pins).map((name) => {
      const pin = run.pins[name], box = document.createElement("div");
      const text = document.createElement("p"), force = add(arrows, "g", {}), flash = add(arrows, "g", {});
      pins.appendChild(box);
      if (!pin.e) {  // a joint without clearance
        box.appendChild(text);
        return { name: name, pin: pin, text: text, force: force, flash: flash };
      }
      const picture = add(box, "svg", { viewBox: "-70 -70 140 140", role: "img", "aria-label": "Pin " + name + " in its bushing" });
      add(picture, "path", { d: "M-66-66H66V66H-66Z M" + BUSHING + " 0A" + BUSHING + " " + BUSHING + " 0 1 0 " + -BUSHING + " 0A" + BUSHING + " " + BUSHING + " 0 1 0 " + BUSHING + " 0Z", fill: PALE, "fill-rule": "evenodd" });
      add(picture, "circle", { r: BUSHING, fill: "none", stroke: INK, "stroke-width": 1.2 });
      const gap = pin.gap ? pin.gap * BUSHING : USUAL_GAP;
      const reach = add(picture, "circle", { r: gap, fill: "none", stroke: INK, "stroke-width": 0.6, "stroke-dasharray": "2 2" });
      const disc = add(picture, "circle", { r: BUSHING - gap, fill: "#56b4e9", "fill-opacity": 0.45, stroke: BLUE, "stroke-width": 1.2 });
      const path = add(picture, "path", { d: pin.e.length ? line(pin.e.map((e) => [gap * e[0], gap * e[1]]), true) : "", fill: "none", stroke: BLUE, "stroke-width": 0.5, opacity: 0.6 });
      const centre = add(picture, "circle", { r: 2, fill: INK });
      const push = add(picture, "g", {}), hit = add(picture, "g", {});
      add(picture, "text", { x: -62, y: -50, "font-size": 16, "font-weight": 700, fill: VERMILION, "font-family": "sans-serif" }, name);
      box.appendChild(text);
      return { name: name, pin: pin, disc: disc, centre: centre, path: path, reach: reach, push: push, hit: hit, text: text, force: force, flash: flash, gap: gap, trail: [] };
    });
    show(frame);
  }

  function move(part, index, e, f, hit) {
    const size = Math.hypot(f[0], f[1]), share = Math.sqrt(size / data.longest_n), flash = hit ? 0.4 + Math.sqrt(hit / data.longest_n) : 0;
    const place = joints[part.name].path[index];
    arrow(part.force, place[0], place[1], f[0], f[1], share * data.arrow_mm, 0.9 * unit);
    spark(part.flash, place[0], place[1], 6 * unit * flash);
    part.text.textContent = part.name + ": " + (size < 0.05 ? "free" : size.toFixed(0) + " N");
    if (!e) return;
    const x = part.gap * e[0], y = part.gap * e[1];
    for (const circle of [part.disc, part.centre]) {
      circle.setAttribute("cx", x);
      circle.setAttribute("cy", y);
    }
    arrow(part.push, x, y, f[0], f[1], share * 34, 2);
    const far = Math.hypot(x, y) || 1;
    spark(part.hit, x + (BUSHING - part.gap) * x / far, y + (BUSHING - part.gap) * y / far, 20 * flash);
  }

  // A frame as it comes: crank angle [deg]; for each joint place [clearances] and force [N], both with y downwards,
  // hardest impact since the last frame [N], and drawn clearance as a fraction of the bushing's radius.
  function live(now) {
    const turn = ((now.angle % 360) + 360) % 360;
    show(Math.round(turn / 360 * data.frames) % data.frames);
    angle.textContent = "crank at " + turn.toFixed(0) + "°";
    parts.forEach((part) => {
      const joint = now.joints[part.name];
      if (!joint) return;
      data.longest_n = Math.max(data.longest_n, joint.hit, Math.hypot(joint.f[0], joint.f[1]));
      part.gap = joint.gap * BUSHING;
      part.reach.setAttribute("r", part.gap);
      part.disc.setAttribute("r", BUSHING - part.gap);
      part.trail.push([part.gap * joint.e[0], part.gap * joint.e[1]]);
      if (part.trail.length > TRAIL) part.trail.shift();
      part.path.setAttribute("d", line(part.trail, false));
      move(part, frame, joint.e, joint.f, joint.hit);
    });
  }

  function show(index) {
    frame = index;
    if (slider) {
      const degrees = Number(data.angles[index].toFixed(data.digits));
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
    inLine.forEach((mark) => mark.path.setAttribute("visibility", mark.frame === index ? "visible" : "hidden"));
    if (data.said[index]) words.push(data.said[index]);
    said.textContent = words.join(" ");
    parts.forEach((part) => {
      if (!part.pin.f.length) return;  // no frame came yet
      move(part, index, part.pin.e && part.pin.e[index], part.pin.f[index], part.pin.hit ? part.pin.hit[index] : 0);
    });
    root.dataset.frame = index;
  }

  // A crank that does not turn through goes to and fro.
  let way = 1;
  function next() {
    if (data.turns) return (frame + data.skip) % data.frames;
    if (frame + way * data.skip < 0 || frame + way * data.skip >= data.frames) way = -way;
    return Math.min(Math.max(frame + way * data.skip, 0), data.frames - 1);
  }

  if (data.marks.length || data.joints.some((joint) => joint.other)) said.hidden = false;
  if (choice) choice.addEventListener("change", () => choose(Number(choice.value)));
  if (slider && !data.live) {
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
  if (data.live) root.live = live;
  choose(0);
  if (data.first) show(data.first);
  }
  document.addEventListener("replaced", begin);
  begin();
})();
