// One truck's history. The numbers of all trucks are in the page, compressed; the first click unpacks them.
const model = (name) => Bokeh.documents[0].get_model_by_name(name);
const say = (text) => { document.getElementById("summary").textContent = text; };
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
// by status, the words before an offset that is not valid, and its colour
const NOT_VALID = {converging: ["still converging", `${COLOURS.estimate}70`], invalid: ["before the fault", COLOURS.rejected]};

const show = ({now, limit, all, together, drives, changes}) => {
  const estimated = drives.filter((drive) => drive.offset !== null && drive.sd !== null && drive.status !== "unobservable");
  const ofOffset = changes.filter((change) => change.quantity === "offset");
  document.getElementById("history").hidden = false;
  const newest = all > drives.length ? `the newest ${drives.length} of ${all} drives` : `${all} ${all === 1 ? "drive" : "drives"}`;
  say(`${newest}, ${estimated.length} with an offset, ${ofOffset.length} ${ofOffset.length === 1 ? "change" : "changes"} of it; ` +
      `limit ±${limit} deg` + (together && `; ${together}`));
  model("band width").setv({bottom: -limit, top: limit});
  model("lower width").location = -limit;
  model("upper width").location = limit;
  model("drives").data = {
    time: estimated.map((drive) => drive.start), value: estimated.map((drive) => drive.offset),
    low: estimated.map((drive) => drive.offset - 1.96 * drive.sd), high: estimated.map((drive) => drive.offset + 1.96 * drive.sd),
    log: estimated.map((drive) => drive.log),
    colour: estimated.map((drive) => NOT_VALID[drive.status]?.[1] ?? COLOURS.estimate),
    marker: estimated.map((drive) => (drive.status === "invalid" ? "triangle" : "circle")),
    status: estimated.map((drive) => drive.status),
  };
  model("breaks").data = {time: ofOffset.map((change) => (change.after_drive + change.by_drive) / 2)};
  // one line from each change, or the first drive, to the next or the last drive
  const lines = [{from: estimated.length ? estimated[0].start : 0, value: ofOffset.length ? ofOffset[0].before : now}];
  for (const change of ofOffset) lines.push({from: change.by_drive, value: change.after});
  const last = estimated.length ? estimated[estimated.length - 1].start : 0;
  model("means").data = {
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
  for (const title of ["Quantity", "Between (UTC)", "From", "To", "Change, 95 %", "Cause"]) cell(head, title, "th");
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
  for (const title of ["Start (UTC)", "Offset (deg), 95 %", "Status", "Log"]) cell(head, title, "th");
  const body = table.createTBody();
  for (const drive of drives.toReversed()) {
    const row = body.insertRow();
    cell(row, day(drive.start));
    const has = drive.offset !== null && drive.sd !== null;
    const but = NOT_VALID[drive.status]?.[0];
    const offset = has ? `${signed(drive.offset, 1)} ± ${(1.96 * drive.sd).toFixed(1)}` : "—";
    cell(row, has && but ? `${but} ${offset}` : offset, "td", has && but ? "number not-valid" : "number");
    cell(row, drive.error ?? drive.status ?? "", "td", drive.error ? "refused" : "");
    const log = cell(row, drive.log, "th");
    log.scope = "row";
    if (drive.report) log.appendChild(document.createElement("small")).textContent = `report: ${drive.report}`;
  }
};

let unpacking = null;
const trucks = () => {
  unpacking ??= (async () => {
    const text = atob(document.getElementById("data").textContent), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
    const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Map(Object.entries(await new Response(unpacked).json()));
  })();
  return unpacking;
};

const openTruck = async () => {
  const name = decodeURIComponent(location.hash.slice(1));
  if (!name) return;
  let histories;
  try {
    histories = await trucks();
  } catch {
    return say("This browser cannot unpack the trucks' histories: use a version of 2023 or later.");
  }
  if (!histories.has(name)) return say(`There is no truck ${name}.`);
  show(histories.get(name));
  document.getElementById("name").value = name;
  document.getElementById("truck").scrollIntoView();
};
document.getElementById("name").addEventListener("change", (event) => {
  location.hash = encodeURIComponent(event.target.value.trim());
});
addEventListener("hashchange", openTruck);
const whenReady = () => (Bokeh.documents.length ? openTruck() : setTimeout(whenReady, 20));
whenReady();
