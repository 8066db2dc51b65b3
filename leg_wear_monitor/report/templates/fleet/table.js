"use strict";
(function () {
  const root = document.getElementById("fleet-legs");
  if (!root) return;
  const data = JSON.parse(root.querySelector("script").textContent), legs = data.legs;
  const FIRST = 50, MORE = 250;  // rows: a screen shows fewer than fifty, and a thousand take a second to lay out
  const form = root.querySelector("form"), search = form.querySelector("input"), said = form.querySelector("output");
  const choices = Array.from(form.querySelectorAll("select"));
  const head = root.querySelector("thead"), body = root.querySelector("tbody");
  const more = root.querySelector(".more");
  const low = Math.log(data.life_h[0]), span = Math.log(data.life_h[1]) - low || 1;

  function make(tag, text, name) {
    const element = document.createElement(tag);
    if (text !== undefined) element.textContent = text;
    if (name) element.className = name;
    return element;
  }
  const short = (value) => (value >= 100 ? Math.round(value).toString() : Number(value.toPrecision(3)).toString());
  const place = (hours) => (100 * Math.min(Math.max((Math.log(Math.max(hours, 1e-9)) - low) / span, 0), 1)).toFixed(1) + "%";

  function nameCell(leg) {
    const cell = make("th");
    cell.scope = "row";
    if (!leg.page) {
      cell.textContent = leg.id;
      return cell;
    }
    const link = make("a", leg.id);
    link.href = leg.page;
    cell.append(link);
    return cell;
  }
  function stateCell(leg) {
    const cell = make("td", undefined, "state"), word = make("strong", undefined, leg.tone), symbol = make("span", leg.symbol);
    symbol.setAttribute("aria-hidden", "true");
    word.append(symbol, " " + leg.standing);
    cell.append(word);
    return cell;
  }
  function usedCell(value) {
    if (value === null) return make("td", "–");
    if (value === "not valid") return make("td", value, "not-valid");
    return make("td", Math.round(value[0]).toString(), "b" + value[1]);
  }
  function lifeCell(leg) {
    if (!leg.life) return make("td", "not known", "not-valid life");
    const cell = make("td", undefined, "life"), bar = make("span", undefined, "interval");
    const range = make("span", undefined, "range"), median = make("span", undefined, "median");
    range.style.left = place(leg.life[0]);
    range.style.right = 100 - parseFloat(place(leg.life[2])) + "%";
    median.style.left = place(leg.life[1]);
    bar.append(range, median);
    cell.append(short(leg.life[1]) + " (" + short(leg.life[0]) + " to " + short(leg.life[2]) + ")", bar);
    return cell;
  }
  function changeText(leg) {
    const parts = leg.was ? ["was " + leg.was] : [];
    if (leg.rise && Math.abs(leg.rise[0]) >= 0.05) parts.push(leg.rise[1] + " " + (leg.rise[0] > 0 ? "+" : "−") + Math.abs(leg.rise[0]).toPrecision(2) + " %");
    return parts.join(", ") || "–";
  }
  function ageText(leg) {
    if (leg.age === null) return "none";
    const days = leg.age < 0 ? "in the future" : leg.age < 1 ? "within a day" : Math.floor(leg.age) + " d ago";
    return leg.is_old && leg.age >= 0 ? days + ", too old" : days;
  }
  const columns = [
    { title: "Leg", cell: nameCell, by: (leg) => leg.id },
    { title: "State", cell: stateCell, by: (leg) => leg.rank },
    { title: "Lot", cell: (leg) => make("td", leg.lot || "–", "word"), by: (leg) => leg.lot || null },
    ...data.joints.map((joint, k) => ({
      title: joint, joint: true, cell: (leg) => usedCell(leg.used[k]),
      by: (leg) => (Array.isArray(leg.used[k]) ? -leg.used[k][0] : null)
    })),
    { title: "Remaining life [h]", cell: lifeCell, by: (leg) => (leg.life ? leg.life[0] : null) },
    { title: "Change", cell: (leg) => make("td", changeText(leg), "word"), by: (leg) => (leg.rise || leg.was ? -(leg.was ? 1e6 : 0) - (leg.rise ? leg.rise[0] : 0) : null) },
    { title: "Last recording", cell: (leg) => make("td", ageText(leg), "word"), by: (leg) => (leg.age === null ? null : -leg.age) },
    { title: "Recordings", cell: (leg) => make("td", leg.counted + (leg.bad ? ", " + leg.bad + " not sound" : ""), "word"), by: (leg) => -leg.bad },
    { title: "Why", cell: (leg) => make("td", leg.why + (leg.code && leg.code !== "NONE" ? " [" + leg.code + "]" : ""), "why") }
  ];

  const texts = new Map(legs.map((leg) => [leg, [leg.id, leg.lot, leg.standing, leg.why, leg.code].join("\n").toLowerCase()]));
  let sorted = legs, found = legs, shown = 0, order = { column: null, sign: 1 };

  // What is not known comes last, whichever way the column is sorted; equals keep the order of the description.
  function compare(a, b) {
    if (a === null || b === null) return (a === null) - (b === null);
    return order.sign * (typeof a === "string" ? a.localeCompare(b, "en", { numeric: true }) : a - b);
  }
  function draw(number) {
    const rows = document.createDocumentFragment();
    found.slice(shown, shown + number).forEach((leg) => {
      const row = make("tr");
      row.append(...columns.map((column) => column.cell(leg)));
      rows.append(row);
    });
    body.append(rows);
    shown = Math.min(shown + number, found.length);
    more.hidden = shown === found.length;
    said.textContent = found.length + " of " + legs.length + " legs" + (shown < found.length ? ", the first " + shown + " are shown" : "");
  }
  function select() {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    found = sorted.filter((leg) =>
      choices.every((choice) => !choice.value || leg[choice.dataset.key] === choice.value) &&
      words.every((word) => texts.get(leg).includes(word)));
    root.dispatchEvent(new CustomEvent("legs", { detail: { legs: found, joints: data.joints } }));
    body.replaceChildren();
    shown = 0;
    draw(FIRST);
  }
  function sortBy(column) {
    order = { column: column, sign: order.column === column ? -order.sign : 1 };
    const keys = new Map(legs.map((leg) => [leg, column.by(leg)]));
    sorted = legs.slice().sort((a, b) => compare(keys.get(a), keys.get(b)));
    columns.forEach((each) => each.head.setAttribute("aria-sort", each !== column ? "none" : order.sign > 0 ? "ascending" : "descending"));
    select();
  }

  const titles = make("tr");
  columns.forEach((column) => {
    column.head = make("th", undefined, column.joint ? "joint" : "");
    column.head.scope = "col";
    if (column.by) {
      const button = make("button", column.title);
      button.type = "button";
      button.addEventListener("click", () => sortBy(column));
      column.head.append(button);
    } else column.head.textContent = column.title;
    titles.append(column.head);
  });
  head.append(titles);
  search.addEventListener("input", select);
  choices.forEach((choice) => choice.addEventListener("change", select));
  form.addEventListener("submit", (event) => event.preventDefault());
  more.querySelector("button").addEventListener("click", () => draw(MORE));
  window.addEventListener("beforeprint", () => { if (shown < found.length) draw(found.length); });  // paper has no button
  root.querySelectorAll("form, .scroll, .map").forEach((part) => { part.hidden = false; });
  sortBy(columns[1]);
})();
