"use strict";
// Drive torque of the gait cycle that the slider plays, with its crank angle.
(function () {
  const leg = document.getElementById("leg-slider"), figure = document.querySelector(".torque-phase");
  const cycles = JSON.parse(figure.querySelector(".cycles").textContent), choice = leg.querySelector(".run");

  function draw() {
    const shown = choice ? Number(choice.value) + 1 : cycles.length;
    torquePhase.draw(figure.querySelector("svg"), cycles.slice(0, shown), Number(figure.dataset.limit), Number(leg.dataset.frame));
  }

  new MutationObserver(draw).observe(leg, { attributes: true, attributeFilter: ["data-frame"] });
  if (choice) choice.addEventListener("change", draw);
  draw();
})();
