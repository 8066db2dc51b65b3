"use strict";
// Shows the trends of the joint that is chosen; the choice outlasts new data.
(function () {
  let chosen = null;

  function show() {
    const region = document.querySelector('[data-region="trends"]'), select = region && region.querySelector("select.joint");
    if (!select) return;
    if (chosen !== null && Array.from(select.options).some((option) => option.value === chosen)) select.value = chosen;
    region.querySelectorAll("[data-joint]").forEach((part) => { part.hidden = part.dataset.joint !== select.value; });
    document.dispatchEvent(new Event("shown"));
  }

  document.addEventListener("change", (event) => {
    if (!event.target.matches('[data-region="trends"] select.joint')) return;
    chosen = event.target.value;
    event.target.blur();  // what is in use is not replaced
    show();
  });
  document.addEventListener("replaced", show);
  show();
})();
