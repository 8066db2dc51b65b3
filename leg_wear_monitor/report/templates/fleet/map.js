"use strict";
(function () {
  const root = document.getElementById("fleet-legs");
  if (!root) return;
  const canvas = root.querySelector("canvas"), said = root.querySelector(".map .note"), hint = said.textContent;
  const ROW = 26, LEFT = 24;  // CSS pixels: height of a joint, width of its name
  let legs = [], joints = [], pointed;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // The worst leg stands for those that share a column of pixels.
  function worst(k, begin, end) {
    let most = null;
    for (let i = begin; i < end; i++) {
      const cell = legs[i].used[k];
      if (Array.isArray(cell) && (most === null || cell[0] > most[0])) most = cell;
    }
    return most;
  }
  function draw() {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth, context = canvas.getContext("2d");
    if (!width) return;
    canvas.style.height = joints.length * ROW + "px";
    canvas.width = width * ratio;
    canvas.height = joints.length * ROW * ratio;
    context.scale(ratio, ratio);
    context.font = "600 13px system-ui, sans-serif";
    const tints = ["--edge", "--blue", "--blue", "--series-1", "--bad"].map(colour), ink = colour("--ink"), pale = colour("--wash");
    const columns = Math.max(1, Math.min(legs.length, Math.floor(width - LEFT))), step = (width - LEFT) / columns;
    joints.forEach((joint, k) => {
      const bottom = (k + 1) * ROW - 2, high = ROW - 4;
      context.fillStyle = pale;
      context.fillRect(LEFT, bottom - high, width - LEFT, high);
      context.fillStyle = ink;
      context.fillText(joint, 2, bottom - 6, LEFT - 4);
      for (let i = 0; i < columns; i++) {
        const cell = worst(k, Math.floor(i * legs.length / columns), Math.floor((i + 1) * legs.length / columns));
        if (cell === null) continue;
        const part = Math.min(Math.max(cell[0] / 100, 0.03), 1) * high;
        context.fillStyle = tints[cell[1]];
        context.fillRect(LEFT + i * step, bottom - part, step > 3 ? step - 1 : step, part);
      }
    });
  }
  function at(event) {
    const place = (event.offsetX - LEFT) / (canvas.clientWidth - LEFT);
    return place < 0 || !legs.length ? undefined : legs[Math.min(Math.floor(place * legs.length), legs.length - 1)];
  }
  function point(event) {
    const leg = pointed = at(event);
    said.textContent = leg ? leg.id + ": " + joints.map((joint, k) =>
      joint + " " + (Array.isArray(leg.used[k]) ? Math.round(leg.used[k][0]) + " %" : leg.used[k] || "–")).join(", ") : hint;
  }
  canvas.addEventListener("pointermove", point);
  canvas.addEventListener("pointerdown", point);
  canvas.addEventListener("pointerleave", () => { said.textContent = hint; });
  canvas.addEventListener("click", () => {  // its own place is in whole pixels: it can be that of the next leg
    const search = root.querySelector("input");
    if (!pointed) return;
    search.value = pointed.id;
    search.dispatchEvent(new Event("input"));
  });
  let waits = false;
  function later() {  // typing is answered first
    if (waits) return;
    waits = true;
    requestAnimationFrame(() => { waits = false; draw(); });
  }
  root.addEventListener("legs", (event) => {
    legs = event.detail.legs;
    joints = event.detail.joints;
    later();
  });
  window.addEventListener("resize", later);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", later);
})();
