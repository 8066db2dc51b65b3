"use strict";
// Renews the page from its server: replaces the regions that have changed, and says how old the data are.
(function () {
  const NO_WORD_S = 4;  // without a word of the server, which has one every second
  const root = document.documentElement, settings = JSON.parse(root.dataset.live);
  const strip = document.createElement("p"), said = document.createElement("p");
  const waiting = new Map();  // regions that the reader is using just now
  let age = settings.age_s, silence = settings.silence, oldAfter = settings.old_after_s, words = settings.words, heard = Date.now(), spoken = "";

  strip.className = "freshness";
  strip.setAttribute("role", "status");
  said.className = "unseen";
  said.setAttribute("aria-live", "assertive");
  document.querySelector("header").prepend(strip, said);

  const duration = (s) => (s < 120 ? Math.round(s) + " s" : s < 7200 ? Math.round(s / 60) + " min" : s < 172800 ? Math.round(s / 3600) + " h" : Math.round(s / 86400) + " d");

  function speak(text) {  // only what is new, not each second
    if (text !== spoken) said.textContent = spoken = text;
  }

  function tell() {
    const quiet = (Date.now() - heard) / 1000, old = age === null ? null : age + quiet;
    let text, isOld = true, kind = "";
    if (quiet > NO_WORD_S) {
      kind = "The dashboard does not answer";
      text = "NO CONNECTION to the dashboard for " + duration(quiet) + ": what is shown is old";
    } else if (old === null) {
      kind = text = silence;
    } else if (old > oldAfter) {
      kind = silence;
      text = "NO DATA for " + duration(old) + ": " + silence;
    } else {
      isOld = false;
      text = "Live, data " + duration(old) + " old";
    }
    strip.textContent = text;
    root.toggleAttribute("data-old", isOld);
    strip.toggleAttribute("data-old", isOld);
    document.querySelector("h1").textContent = words.heading;
    document.querySelector(".summary").textContent = words.summary;
    document.title = (isOld ? "? no data – " : "") + words.title;
    speak(isOld ? kind : words.state);
  }

  function isUsed(region) {
    return region.matches(":focus-within") || (region.dataset.region === "trends" && region.matches(":hover"));
  }

  function replace(name, markup) {
    const region = document.querySelector('[data-region="' + name + '"]');
    if (!region) return;
    if (isUsed(region)) {
      waiting.set(name, markup);
      return;
    }
    waiting.delete(name);
    region.innerHTML = markup;  // escaped by the server; no script in it would run
    document.dispatchEvent(new Event("replaced"));
  }

  const events = new EventSource("events");
  events.addEventListener("state", (event) => {
    const state = JSON.parse(event.data);
    heard = Date.now();
    age = state.age_s;
    silence = state.silence;
    oldAfter = state.old_after_s;
    words = state.words;
    Object.entries(state.regions).forEach(([name, markup]) => replace(name, markup));
    tell();
  });
  setInterval(() => {
    waiting.forEach((markup, name) => replace(name, markup));
    tell();
  }, 1000);
  window.addEventListener("pagehide", () => events.close());
  window.addEventListener("pageshow", (event) => { if (event.persisted) location.reload(); });
  tell();
})();
