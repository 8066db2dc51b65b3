"use strict";
// Moves the leg as frames come from the server; a hidden tab, a paused picture and one behind an edge ask for none.
(function () {
  const cycles = [], still = matchMedia("(prefers-reduced-motion: reduce)");
  let source = null, playing = !still.matches, isSeen = true;

  const leg = () => document.getElementById("leg-slider");
  const chart = () => document.querySelector(".torque-phase");

  function take(event) {
    const frame = JSON.parse(event.data), there = leg(), figure = chart();
    if (there && there.live) there.live(frame);
    if (frame.torque && figure) {
      cycles.push(frame.torque);
      if (cycles.length > torquePhase.most) cycles.shift();
      torquePhase.draw(figure.querySelector("svg"), cycles, Number(figure.dataset.limit));
    }
  }

  function update() {
    const button = leg() && leg().querySelector(".play"), isWanted = Boolean(button) && playing && isSeen && !document.hidden;
    if (button) {
      button.textContent = playing ? "Pause" : "Play";
      button.setAttribute("aria-pressed", String(playing));
    }
    if (isWanted && !source) {
      source = new EventSource("motion");
      source.addEventListener("frame", take);
    } else if (!isWanted && source) {
      source.close();
      source = null;
    }
  }

  // The picture that a renewed page took away is out of sight, too: only the present one counts.
  const sight = new IntersectionObserver((entries) => {
    const own = entries.filter((entry) => entry.target === leg());
    if (own.length) isSeen = own[own.length - 1].isIntersecting;
    update();
  });

  function begin() {
    const there = leg(), button = there && there.querySelector(".play");
    if (!button || button.dataset.ready) return;
    button.dataset.ready = "1";
    button.addEventListener("click", () => { playing = !playing; update(); });
    sight.disconnect();
    sight.observe(there);
    update();
  }

  document.addEventListener("visibilitychange", update);
  document.addEventListener("replaced", begin);
  window.addEventListener("pagehide", () => { if (source) source.close(); source = null; });
  begin();
})();
