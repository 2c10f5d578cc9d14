// One truck's history: its numbers come as a script beside the page, for a page on a disk may fetch nothing else.
const source = (name) => Bokeh.documents[0].get_model_by_name(name);
const cell = (row, text, kind = "td", style = "") => {
  const made = row.appendChild(document.createElement(kind));
  made.textContent = text;
  made.className = style;
  return made;
};
const day = (ms) => (ms === null ? "—" : new Date(ms).toISOString().slice(0, 16).replace("T", " "));
const signed = (number, digits) => (number > 0 ? "+" : "") + number.toFixed(digits).replace("-", "−");
const digitsOf = (unit) => (unit === "deg" ? 1 : 2);
const words = (name) => name.replaceAll("_", " ");
// what stands before a drive's offset that is not valid, and its colour
const NOT_VALID = {converging: ["still converging", `${COLOURS.estimate}70`], invalid: ["before the fault", COLOURS.rejected]};

const show = ({now, together, drives, changes}) => {
  const told = drives.filter((drive) => drive.offset !== null && drive.sd !== null && drive.status !== "unobservable");
  const ofOffset = changes.filter((change) => change.quantity === "offset");
  document.getElementById("history").hidden = false;
  document.getElementById("told").textContent =
    `${drives.length} drives, ${told.length} with an offset, ${ofOffset.length} ${ofOffset.length === 1 ? "change" : "changes"} of it` +
    (together && `; ${together}`);
  source("drives").data = {
    time: told.map((drive) => drive.start), value: told.map((drive) => drive.offset),
    low: told.map((drive) => drive.offset - 1.96 * drive.sd), high: told.map((drive) => drive.offset + 1.96 * drive.sd),
    log: told.map((drive) => drive.log), report: told.map((drive) => drive.report),
    colour: told.map((drive) => NOT_VALID[drive.status]?.[1] ?? COLOURS.estimate),
    status: told.map((drive) => drive.status),
  };
  source("breaks").data = {time: ofOffset.map((change) => (change.after_drive + change.by_drive) / 2)};
  // one line from each change, or the first drive, to the next or the last drive
  const lines = [{from: told.length ? told[0].start : 0, value: ofOffset.length ? ofOffset[0].before : now}];
  for (const change of ofOffset) lines.push({from: change.by_drive, value: change.after});
  const last = told.length ? told[told.length - 1].start : 0;
  source("means").data = {
    left: lines.map((line) => line.from), value: lines.map((line) => line.value),
    right: lines.map((line, k) => (k < ofOffset.length ? ofOffset[k].after_drive : last)),
  };
  changesTable(changes);
  drivesTable(drives);
};

const changesTable = (changes) => {
  const table = document.getElementById("changes");
  table.replaceChildren();
  if (!changes.length) return;
  const head = table.createTHead().insertRow();
  for (const title of ["What changed", "Between (UTC)", "From", "To", "By, 95 %", "Put down to"]) cell(head, title, "th");
  const body = table.createTBody();
  for (const change of changes) {
    const row = body.insertRow(), digits = digitsOf(change.unit), unit = change.unit.replace("_", "/").replace("s2", "s²");
    cell(row, words(change.quantity), "th");
    cell(row, `${day(change.after_drive)} and ${day(change.by_drive)}`);
    cell(row, `${signed(change.before, digits)} ${unit}`, "td", "number");
    cell(row, `${signed(change.after, digits)} ${unit}`, "td", "number");
    cell(row, `${signed(change.size, digits)} ± ${(1.96 * change.sd).toFixed(digits)}`, "td", "number");
    cell(row, change.cause === null ? "" : words(change.cause));
  }
};

const drivesTable = (drives) => {
  const table = document.getElementById("drives");
  table.replaceChildren();
  const head = table.createTHead().insertRow();
  for (const title of ["Begin (UTC)", "Offset (deg), 95 %", "", "Log"]) cell(head, title, "th");
  const body = table.createTBody();
  for (const drive of drives.toReversed()) {
    const row = body.insertRow();
    cell(row, day(drive.start));
    const told = drive.offset !== null && drive.sd !== null;
    const but = NOT_VALID[drive.status]?.[0];
    const offset = told ? `${signed(drive.offset, 1)} ± ${(1.96 * drive.sd).toFixed(1)}` : "—";
    cell(row, told && but ? `${but} ${offset}` : offset, "td", told && but ? "number not-valid" : "number");
    cell(row, drive.error ?? drive.status ?? "", "td", drive.error ? "refused" : "");
    const log = cell(row, drive.report ? "" : drive.log, "th");
    log.scope = "row";
    if (drive.report) {
      const link = log.appendChild(document.createElement("a"));
      link.href = drive.report;
      link.textContent = drive.log;
    }
  }
};

const openTruck = () => {
  const name = decodeURIComponent(location.hash.slice(1));
  if (!name) return;
  const unknown = () => { document.getElementById("told").textContent = `no truck ${name}`; };
  const truck = [...document.getElementById("names").options].find((option) => option.value === name);
  if (!truck) return unknown();
  const script = document.createElement("script");
  script.src = `trucks/${encodeURIComponent(truck.dataset.file ?? name)}.js`;
  script.onload = () => {
    document.getElementById("name").value = name;
    document.getElementById("truck").scrollIntoView();
  };
  script.onerror = unknown;
  document.body.append(script);
};
document.getElementById("name").addEventListener("change", (event) => {
  location.hash = encodeURIComponent(event.target.value.trim());
});
addEventListener("hashchange", openTruck);
const whenReady = () => (Bokeh.documents.length ? openTruck() : setTimeout(whenReady, 20));
whenReady();
