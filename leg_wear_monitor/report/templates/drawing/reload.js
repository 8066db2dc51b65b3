"use strict";
// Loads the page again every second, and keeps the crank angle, whether it plays, and the focus.
(function () {
  const box = document.querySelector("#reload input"), leg = document.getElementById("leg-slider");
  const slider = leg.querySelector("input[type=range]"), play = leg.querySelector(".play");
  const focusable = () => Array.from(document.querySelectorAll("a, button, input, select, [tabindex]"));
  let held = false;

  function restore() {
    const kept = new URLSearchParams(location.hash.slice(1));
    if (slider && kept.has("position")) {
      slider.value = kept.get("position");
      slider.dispatchEvent(new Event("input"));
      if (kept.get("plays") === "true") play.click();
    }
    const focused = focusable()[Number(kept.get("focus") || -1)];
    if (focused) focused.focus({ preventScroll: true });
  }
  function again() {
    if (!box.checked || held) return;
    const kept = new URLSearchParams({ focus: focusable().indexOf(document.activeElement) });
    if (slider) {
      kept.set("position", slider.value);
      kept.set("plays", play.getAttribute("aria-pressed"));
    }
    history.replaceState(null, "", "#" + kept);
    location.reload();
  }
  document.addEventListener("pointerdown", () => { held = true; });
  document.addEventListener("pointerup", () => { held = false; });
  restore();
  setInterval(again, 1000);
})();
