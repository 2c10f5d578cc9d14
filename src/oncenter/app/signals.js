"use strict";
// The signals of a truck: a row each, beside what it should look like. What is chosen here is kept with the truck.
let dialog = null; // {about: the truck and its files, title, names of the list, similar ones by signal, at_s of the pictures}
const rows = new Map(); // by signal, those on the page
const MARKS = {bad: "!", open: "?", ok: marks.ok};
const NAMES_MAX = 30; // of the list at once

// Shows the rows; keeps the truck at once where there is nothing to choose.
async function chooseSignals(about, title, state) {
  const cancel = new AbortController(), button = made("button", texts.cancel);
  button.type = "button";
  button.addEventListener("click", () => cancel.abort());
  state.replaceChildren(`${texts.signals_searching} `, button);
  try {
    const found = await send("POST", "/signals", about, cancel.signal);
    if (!found.rows.length && about.truck && !about.name) throw new Error(texts.signals_none);
    dialog = {about, title, names: found.names, similar: found.similar, at_s: null, isTouched: false};
    rows.clear();
    if (!found.rows.length) {
      await keep();
      return;
    }
    const needed = found.rows.filter((each) => each.needed || each.name || each.source);
    part("rows").replaceChildren(...needed.map(rowOf));
    part("other-rows").replaceChildren(...found.rows.filter((each) => !needed.includes(each)).map(rowOf));
    part("more-rows").hidden = needed.length === found.rows.length;
    part("signals-log").hidden = about.logs.length > 0;
    showRows(found);
    opened(true);
    part("signals-title").focus();
  } finally {
    state.textContent = "";
  }
}

function opened(isOpen) {
  part("signals").hidden = !isOpen;
  part("truck-choice").hidden = isOpen;
}

async function keep() {
  if (dialog.about.truck && former.length && !confirm(texts.forget_old)) return;
  part("keep").disabled = true; // once, also where a log arrives meanwhile
  try {
    const signals = rows.size ? chosen() : undefined;
    const kept = await send("POST", "/trucks", {...dialog.about, signals});
    opened(false);
    chooseKept(kept, dialog.title);
    dialog = null;
  } finally {
    part("keep").disabled = false;
  }
}

const chosen = () =>
  Object.fromEntries([...rows].filter(([, {given}]) => given.name).map(([signal, {given}]) => [signal, given]));

// Reads the log again with what is chosen now; a change that comes meanwhile is read after it.
let reading = false, again = false;
async function refresh() {
  again = dialog.isTouched = true;
  if (reading) return;
  reading = true;
  part("signals").setAttribute("aria-busy", "true");
  part("signals-state").textContent = texts.signals_reading;
  part("keep-wrong").textContent = "";
  while (again) {
    again = false;
    const of = dialog;
    try {
      const found = await send("POST", "/signals", {...of.about, signals: chosen(), at_s: of.at_s});
      if (of === dialog && !again) showRows(found);
    } catch (error) {
      part("keep-wrong").textContent = error.message;
    }
  }
  reading = false;
  part("signals").setAttribute("aria-busy", "false");
  part("signals-state").textContent = "";
}

function showRows({rows: found, notes, at_s}) {
  dialog.at_s = at_s;
  part("moved").hidden = at_s === null;
  const list = made("ul");
  list.append(...notes.map((note) => made("li", note)));
  part("rest").replaceChildren(...(notes.length ? [made("p", texts.signals_rest), list] : []));
  for (const each of found) rows.get(each.signal).fill(each);
  part("still-wrong").hidden = !found.some(({said}) => said.some(([state]) => state === "bad"));
  part("earlier").disabled = at_s === 0;
}

let count = 0;
function rowOf({signal, units, has_sign: hasSign, why}) {
  const shown = made("div", "", "signal"), title = made("h4", texts[signal]), controls = made("div");
  const name = made("strong"), source = made("small"), said = made("ul", "", "said"), figure = made("figure");
  const choose = made("button", texts.row_choose), list = made("div", "", "list");
  const unit = made("select"), unitLabel = made("label", texts.row_unit);
  const sign = made("input"), signLabel = made("label", ` ${texts.row_sign}`, "sign");
  title.id = `signal-${(count += 1)}`;
  shown.setAttribute("role", "group");
  shown.setAttribute("aria-labelledby", title.id);
  choose.type = "button";
  choose.setAttribute("aria-expanded", "false");
  sign.type = "checkbox";
  const flipped = made("small", texts.row_flipped);
  signLabel.prepend(sign);
  signLabel.append(flipped);
  for (const [key, words] of Object.entries(units)) {
    const option = made("option", words);
    option.value = key;
    unit.append(option);
  }
  unitLabel.append(unit);
  controls.append(name, source, unitLabel, signLabel, choose);
  shown.append(title);
  if (texts[`${signal}_what`]) shown.append(made("small", texts[`${signal}_what`]));
  shown.append(said, controls, figure, list);

  const row = {given: {}, fill}, similar = dialog.similar[signal] ?? [];
  function fill(each) {
    row.given = each.name ? {name: each.name, unit: each.unit, sign: each.sign} : {};
    name.textContent = [each.name, ...each.parts].join(", ") || (each.source ? "" : texts.row_none);
    source.textContent = each.source ? `${texts.row_source} ${each.source}` : why && each.name === similar[0] ? `${texts.row_why} ${why}.` : "";
    unitLabel.hidden = !each.name;
    signLabel.hidden = !each.name || !(hasSign || each.sign < 0);
    unit.value = each.unit;
    sign.checked = each.sign < 0;
    flipped.hidden = !sign.checked;
    said.replaceChildren(...each.said.map(([state, text]) => made("li", `${MARKS[state]} ${text}`, `said-${state}`)));
    figure.replaceChildren(...(each.picture ? pictured(each.picture, texts[signal], each.name || each.source) : []));
  }
  const take = (given) => {
    row.given = given;
    refresh();
  };
  const pick = (given) => {
    list.replaceChildren();
    choose.setAttribute("aria-expanded", "false");
    choose.focus();
    take(given);
  };
  unit.addEventListener("change", () => take({...row.given, unit: unit.value}));
  sign.addEventListener("change", () => take({...row.given, sign: sign.checked ? -1 : 1}));
  choose.addEventListener("click", () => {
    const isOpen = choose.getAttribute("aria-expanded") === "true";
    choose.setAttribute("aria-expanded", String(!isOpen));
    list.replaceChildren(...(isOpen ? [] : searched(similar, pick)));
    if (!isOpen) list.querySelector("input").focus();
  });
  list.addEventListener("keydown", ({key}) => {
    if (key !== "Escape") return;
    choose.click();
    choose.focus();
  });
  rows.set(signal, row);
  return shown;
}

// The names that hold what is typed, similar ones first; a click takes one.
function searched(similar, pick) {
  const label = made("label", texts.row_search), search = made("input"), names = made("ul");
  search.type = "search";
  label.append(search);
  const units = new Map(dialog.names), inOrder = [...new Set([...similar.filter((name) => units.has(name)), ...units.keys()])];
  const item = (text, given) => {
    const line = made("li"), button = made("button", text);
    button.type = "button";
    button.addEventListener("click", () => pick(given));
    line.append(button);
    return line;
  };
  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/);
    const fitting = inOrder.filter((name) => words.every((word) => name.toLowerCase().includes(word)));
    const lines = fitting.slice(0, NAMES_MAX).map((name) => item(units.get(name) ? `${name} (${units.get(name)})` : name, {name}));
    const hidden = fitting.length - lines.length;
    const rest = hidden ? [made("li", `${hidden} ${texts.row_more_names}`)] : lines.length ? [] : [made("li", texts.row_no_name)];
    names.replaceChildren(...lines, ...rest, item(texts.row_leave_out, {}));
  };
  search.addEventListener("input", fill);
  fill();
  return [label, names];
}

// Two curves over the same time: the signal, and what it should look like.
function pictured({at_s, step_s, unit, like, curves}, title, name) {
  const values = curves.flat().filter((value) => value !== null);
  const low = Math.min(0, ...values), high = Math.max(0, ...values), air = 0.05 * (high - low) || 1;
  const width = curves[0].length - 1, height = high - low + 2 * air;
  const svg = drawn("svg", {viewBox: `0 0 ${width} 100`, preserveAspectRatio: "none", role: "img"});
  svg.setAttribute("aria-label", [`${title}: ${name}`, ...(curves[1] ? [texts[like]] : [])].join(", "));
  const y = (value) => ((100 * (high + air - value)) / height).toFixed(2);
  svg.append(drawn("path", {class: "zero", d: `M0 ${y(0)}H${width}`}));
  const line = (curve) => curve.map((value, k) => (value === null ? "" : `${curve[k - 1] == null ? "M" : "L"}${k} ${y(value)}`)).join("");
  if (curves[1]) svg.append(drawn("path", {class: "like", d: line(curves[1])}));
  svg.append(drawn("path", {class: "own", d: line(curves[0])}));
  const number = (value) => `${Number(value.toPrecision(3))} ${unit}`;
  const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")} min`;
  const ends = made("div", "", "ends"), legend = made("figcaption");
  ends.append(made("span", clock(at_s)), made("span", clock(at_s + width * step_s)));
  legend.append(made("span", name, "own"), ...(curves[1] ? [made("span", texts[like], "like")] : []));
  return [made("div", number(high), "high"), svg, made("div", number(low), "low"), ends, legend];
}

function drawn(tag, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

part("truck").addEventListener("change", () => {
  part("check-signals").hidden = part("truck").selectedOptions[0].parentElement.dataset.group !== "yours";
  part("check-wrong").textContent = "";
});
part("check-signals").addEventListener("click", () => {
  const truck = part("truck").selectedOptions[0];
  asked("check-wrong", () => chooseSignals({truck: truck.value, logs: wholeLogs()}, truck.textContent, part("check-state")));
});
document.addEventListener("log", () => {
  if (part("signals").hidden || part("keep").disabled || dialog.about.logs.length) return;
  dialog.about.logs = wholeLogs();
  part("signals-log").hidden = true;
  if (dialog.isTouched) refresh();
  else asked("keep-wrong", () => chooseSignals(dialog.about, dialog.title, part("signals-state")));
});
part("keep").addEventListener("click", () => asked("keep-wrong", keep));
part("back").addEventListener("click", () => {
  opened(false);
  dialog = null;
});
for (const [button, by_s] of [["earlier", -120], ["later", 120]]) {
  part(button).addEventListener("click", () => {
    dialog.at_s += by_s;
    refresh();
  });
}
