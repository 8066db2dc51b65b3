"use strict";
// Shows the trends of the joint that is chosen; the choice, and what is unfolded, outlast new data.
(function () {
  let chosen = null, isOpen = false;

  function show() {
    const region = document.querySelector('[data-region="trends"]'), select = region && region.querySelector("select.joint");
    if (!select) return;
    if (chosen !== null && Array.from(select.options).some((option) => option.value === chosen)) select.value = chosen;
    region.querySelectorAll("[data-joint]").forEach((part) => { part.hidden = part.dataset.joint !== select.value; });
    const folded = region.querySelector("details.of-leg");
    if (folded && folded.open !== isOpen) folded.open = isOpen;
    document.dispatchEvent(new Event("shown"));
  }

  document.addEventListener("change", (event) => {
    if (!event.target.matches('[data-region="trends"] select.joint')) return;
    chosen = event.target.value;
    event.target.blur();  // what is in use is not replaced
    show();
  });
  document.addEventListener("toggle", (event) => {
    if (!event.target.matches("details.of-leg") || !event.target.isConnected) return;
    isOpen = event.target.open;
    document.dispatchEvent(new Event("shown"));
  }, true);
  document.addEventListener("replaced", show);
  show();
})();
