"use strict";
// The former drives of the truck that is chosen, and the way to forget them.
let former = []; // {drive, of: as driveOf, text}: for a comparison

const chosenTruck = () => {
  const option = part("truck").selectedOptions[0], group = option.parentElement.dataset.group;
  return {option, group: group ?? option.value, path: `/trucks/${encodeURIComponent(option.value)}`};
};

const tenths = new Intl.NumberFormat("en", {minimumFractionDigits: 1, maximumFractionDigits: 1, signDisplay: "exceptZero"});
const signed = (value) => tenths.format(value).replace("-", "−");
const inDegrees = (offset, interval) => {
  const [value, low, high] = [offset, ...interval].map(signed);
  return `${value} deg (${low} to ${high})`;
};
const day = (start) => (start ? start.slice(0, 16).replace("T", " ") : texts.no_date);

async function listDrives() {
  former = [];
  const {option, group, path} = chosenTruck(), shown = part("drives");
  if (group !== "yours") {
    shown.replaceChildren(...(option.value ? [made("small", texts.not_kept)] : []));
    return;
  }
  try {
    const {drives, common, events, facts, fields} = await send("GET", path);
    if (chosenTruck().option !== option) return; // chosen on meanwhile
    former = drives.map(({drive, log, start, verdict}) => ({drive, of: driveOf({log, start_time: start}), text: `${day(start)}, ${log}: ${verdict.headline}`}));
    const about = made("p", facts.join(" · "), "facts");
    const list = made("ul", "", "drives");
    list.append(...drives.map((each) => driveRow(each, path)));
    const parts = drives.length ? [made("h3", texts.drives), list] : [made("small", texts.no_drives)];
    if (common) {
      const {state, word, count, since, offset, interval} = common, together = made("p");
      const drives = `${count} ${count === 1 ? texts.drive : texts.drives_all}`, when = since ? ` ${texts.since} ${day(since)}` : "";
      together.append(mark(state, word), ` ${texts.together}, ${drives}${when}: ${inDegrees(offset, interval)}`);
      parts.push(together, ...(common.asks ? asking(path) : []));
    }
    if (events.length) parts.push(made("h3", texts.events), eventsOf(events, path));
    shown.replaceChildren(about, changing(fields), ...parts, forgetting(texts.forget_truck, texts.forget_truck_sure, path, () => {
      option.remove();
      part("truck").value = "";
      part("truck").dispatchEvent(new Event("change"));
    }));
  } catch (error) {
    shown.replaceChildren(made("p", error.message, "wrong"));
  }
}

const mark = (state, word) => made("span", `${marks[state]} ${word}`, `state ${state}`);

function driveRow({drive, start, log, offset, interval, verdict}, path) {
  const row = made("li"), said = made("span");
  said.append(mark(verdict.state, verdict.word), ` ${interval ? inDegrees(offset, interval) : texts.no_offset}`);
  const button = forgetting(texts.forget, texts.forget_drive, `${path}/drives/${drive}`, listDrives);
  button.setAttribute("aria-label", `${texts.forget}: ${day(start)}, ${log}`);
  row.append(made("span", day(start)), made("span", log), said, button);
  return row;
}

// A drive that contradicts those before may follow a repair. Stated by a person, it makes the next answer certain.
const ASKED = ["calibrated", "repaired", "changed"];
function asking(path) {
  const buttons = made("p", "", "asked");
  for (const kind of ASKED) {
    const button = made("button", texts[`done_${kind}`], "small");
    button.type = "button";
    button.addEventListener("click", async () => {
      try {
        await send("POST", `${path}/events`, {kind});
        await listDrives();
        forgetAnswer();
      } catch (error) {
        buttons.after(made("p", error.message, "wrong"));
      }
      part("truck").focus();
    });
    buttons.append(button);
  }
  return [made("p", texts.asks, "note"), buttons];
}

function eventsOf(events, path) {
  const list = made("ul", "", "drives");
  for (const [place, {kind, date}] of events.entries()) {
    const row = made("li"), button = forgetting(texts.forget, texts.forget_event, `${path}/events/${place}`, listDrives);
    button.setAttribute("aria-label", `${texts.forget}: ${day(date)}, ${texts[`done_${kind}`]}`);
    row.append(made("span", day(date)), made("span", texts[`done_${kind}`]), made("span"), button);
    list.append(row);
  }
  return list;
}

// The form with the data of the truck, whose name stays.
function changing(fields) {
  const button = made("button", texts.change_truck, "small");
  button.type = "button";
  button.addEventListener("click", () => {
    emptyForm();
    const form = part("form").elements;
    for (const [field, value] of Object.entries(fields)) form[field].value = value;
    part("name").readOnly = true;
    part("other").open = true;
    part("wheelbase_m").focus();
  });
  return button;
}

function forgetting(text, question, path, done) {
  const button = made("button", text, "small");
  button.type = "button";
  button.addEventListener("click", async () => {
    if (!confirm(question)) return;
    try {
      await send("DELETE", path);
      done();
    } catch (error) {
      button.after(made("p", error.message, "wrong"));
    }
    part("truck").focus();
  });
  return button;
}

part("truck").addEventListener("change", listDrives);
