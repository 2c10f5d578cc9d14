"use strict";
// The page: each step sends one request, and an error is a sentence beside what it is about.
const texts = JSON.parse(document.getElementById("texts").textContent);
const marks = JSON.parse(document.getElementById("marks").textContent);
const part = (id) => document.getElementById(id);
const logs = new Map(); // row of the list: {key, request, isWhole}

const made = (tag, text, className) => {
  const element = document.createElement(tag);
  element.textContent = text ?? "";
  element.className = className ?? "";
  return element;
};

async function send(method, path, content, signal) {
  let response;
  try {
    response = await fetch(path, {method, signal, body: content instanceof Blob ? content : JSON.stringify(content)});
  } catch {
    if (signal?.aborted) throw new Error(texts.cancelled);
    throw new Error(texts.lost);
  }
  const said = await response.json();
  if (!response.ok) throw Object.assign(new Error(said.message), said);
  return said;
}

async function asked(wrong, action) {
  part(wrong).textContent = "";
  try {
    return await action();
  } catch (error) {
    if (!atField(error)) part(wrong).textContent = texts[`error_${error.code}`] ?? error.message;
  }
}

// An error of a field stands at that field.
function atField({message, needs}) {
  const said = needs?.length && part(`${needs[0]}-said`);
  if (!said) return false;
  said.textContent = message;
  said.classList.add("wrong");
  part(needs[0]).setAttribute("aria-invalid", "true");
  part(needs[0]).focus();
  for (let around = said.closest("details"); around; around = around.parentElement.closest("details")) around.open = true;
  return true;
}
const wholeLogs = () => [...logs.values()].filter((log) => log.isWhole).map((log) => log.key);
const sent = new Map(); // databases by their files: the form may be sent again

part("form").addEventListener("submit", (event) => {
  event.preventDefault();
  if (part("truck-state").textContent) return; // files are being searched
  asked("truck-wrong", async () => {
    const databases = [];
    for (const file of part("databases").files) {
      if (!sent.has(file)) {
        const {log: key} = await send("POST", "/logs", {name: file.name, size: file.size});
        await send("PUT", `/logs/${key}`, file);
        sent.set(file, key);
      }
      databases.push(sent.get(file));
    }
    const form = Object.fromEntries(new FormData(part("form")));
    const about = {...form, databases, logs: wholeLogs()};
    if (part("name").readOnly) about.truck = part("truck").value; // it is changed
    await chooseSignals(about, form.name, part("truck-state"));
  });
});

function chooseKept({group, name}, title) {
  let list = part("truck").querySelector(`[data-group="${group}"]`);
  if (!list) {
    list = made("optgroup");
    list.label = texts[group];
    list.dataset.group = group;
    part("truck").children[1].after(list);
  }
  let option = [...list.children].find((each) => each.value === name);
  if (!option) {
    option = made("option", title);
    [option.value, option.dataset.axles] = [name, part("form").elements.axle_layout.value];
    list.append(option);
  }
  if (part("name").readOnly) option.dataset.axles = part("form").elements.axle_layout.value;
  option.selected = true;
  part("truck").dispatchEvent(new Event("change"));
  emptyForm();
  part("other").open = false;
  part("logs-wrong").textContent = ""; // of a database, which is kept now
  part(logs.size ? "begin" : "files").focus();
}

function emptyForm() {
  part("form").reset();
  part("name").readOnly = false;
  for (const id of ["name", "wheelbase_m", "steering_ratio"]) clearSaid(id);
}

function add(file) {
  if (isDatabase(file)) return toForm(file);
  const row = made("li"), name = made("span", file.name), state = made("span"), button = made("button", texts.cancel);
  const progress = made("progress");
  button.type = "button";
  button.setAttribute("aria-label", `${texts.cancel}: ${file.name}`);
  row.append(name, state, button, progress);
  part("logs").append(row);
  const log = {key: null, request: new XMLHttpRequest(), isWhole: false};
  logs.set(row, log);
  forgetAnswer();
  const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
  const drop = () => {
    logs.delete(row);
    row.remove();
    forgetAnswer();
  };
  button.addEventListener("click", () => {
    log.request.abort();
    if (log.key) send("DELETE", `/logs/${log.key}`).catch(() => {});
    drop();
  });
  asked("logs-wrong", async () => {
    try {
      log.key = (await send("POST", "/logs", {name: file.name, size: file.size})).log;
    } catch (error) {
      drop();
      throw error;
    }
    await new Promise((done, failed) => {
      const lost = () => {
        drop();
        failed(new Error(JSON.parse(log.request.responseText || "{}").message ?? texts.lost));
      };
      log.request.upload.onprogress = ({loaded, total}) => {
        progress.max = total;
        progress.value = loaded;
        state.textContent = `${texts.copying}: ${megabytes(loaded)} ${texts.of} ${megabytes(total)} MB`;
      };
      log.request.onload = () => (log.request.status === 200 ? done() : lost());
      log.request.onerror = lost;
      log.request.onabort = done;
      log.request.open("PUT", `/logs/${log.key}`);
      log.request.send(file);
    });
    log.isWhole = true;
    document.dispatchEvent(new Event("log"));
    state.textContent = `${megabytes(file.size)} MB, ${texts.ready}`;
    progress.remove();
    button.textContent = texts.remove;
    button.setAttribute("aria-label", `${texts.remove}: ${file.name}`);
  });
}

const isDatabase = ({name}) => part("databases").accept.split(",").some((suffix) => name.toLowerCase().endsWith(suffix));

// A log that is put among the databases belongs to the logs.
part("databases").addEventListener("change", () => {
  const files = [...part("databases").files], databases = new DataTransfer();
  for (const file of files.filter(isDatabase)) databases.items.add(file);
  part("truck-wrong").textContent = "";
  for (const file of files.filter((each) => !isDatabase(each))) {
    add(file);
    part("truck-wrong").textContent = `${file.name}: ${texts.is_log}`;
  }
  if (databases.files.length < files.length) part("databases").files = databases.files;
});

// A database that is dropped among the logs belongs to the form.
function toForm(file) {
  const files = new DataTransfer();
  for (const each of [...part("databases").files, file]) files.items.add(each);
  part("databases").files = files.files;
  part("other").open = true;
  part("logs-wrong").textContent = `${file.name}: ${texts.is_database}`;
}

part("files").addEventListener("change", () => {
  for (const file of part("files").files) add(file);
  part("files").value = "";
});
for (const kind of ["dragover", "dragleave", "drop"]) {
  document.addEventListener(kind, (event) => {
    event.preventDefault(); // the browser would open the log in place of the page
    part("drop").classList.toggle("over", kind === "dragover");
    if (kind === "drop") for (const file of event.dataTransfer.files) add(file);
  });
}

const sleep = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));
let running = null; // key of the answer that is being made

const answers = new Map(); // by key: {truck, drive, text}, for a comparison
// The same of one drive that is answered twice; a log that is dropped again has a number before its name.
const driveOf = ({log, start_time: start}) => `${log.replace(/^\d+-/, "")} ${start}`;
const isOwn = ({group, name}) => group === "yours" && name === part("truck").value; // and was not left meanwhile
const truckOf = ({group, name}) => `${group} ${name}`;

part("begin").addEventListener("click", () => {
  const chosen = part("truck").selectedOptions[0];
  if (!chosen.value && part("other").open && part("name").value) {
    part("answer").replaceChildren(made("p", !part("signals").hidden ? texts.needs_keep : texts.needs_next, "wrong"));
    return;
  }
  const given = {group: chosen.parentElement.dataset.group ?? chosen.value, name: chosen.value};
  for (const field of ["limit", "applied"]) given[field] = part(field).value;
  given.logs = [...logs.values()].map((log) => log.key);
  const names = [...logs.keys()].map((row) => row.firstChild.textContent).join(", ");
  const title = chosen.value ? chosen.textContent : "";
  begin("/answers", given, (key, said) => show(key, said, {...given, title}, names), part("answer"), names).then(listDrives);
});

// An answer is about the truck, the logs and the limit that are chosen: it goes with them.
const forgetAnswer = () => {
  const shown = part("answer");
  if (running || !shown.firstChild) return;
  shown.style.minHeight = `${shown.offsetHeight}px`; // else the page moves away under a click that is under way
  shown.replaceChildren(made("p", texts.changed, "note"));
};
part("truck").addEventListener("change", () => {
  if (!part("name").readOnly) return;
  emptyForm(); // of the truck before
  part("other").open = false;
});
for (const id of ["truck", "limit", "applied"]) part(id).addEventListener("change", forgetAnswer);

// One run of a command: what it says is shown by `done`, in the place `shown`.
async function begin(path, given, done, shown, about) {
  if (part("begin").ariaDisabled) return; // not disabled: that would take the focus of a keyboard away
  part("begin").ariaDisabled = "true";
  shown.replaceChildren(made("p", texts.reading), made("progress"));
  shown.style.minHeight = "";
  try {
    const key = (await send("POST", path, given)).answer;
    running = key;
    part("cancel").hidden = false;
    let state, said;
    do {
      await sleep(0.3);
      ({state, said} = await send("GET", `/answers/${key}`));
    } while (state === "running");
    if (state === "cancelled") shown.replaceChildren(made("p", texts.cancelled));
    else if (state === "failed") shown.replaceChildren(...failure(said, about));
    else shown.replaceChildren(...done(key, said));
  } catch (error) {
    shown.replaceChildren(...(atField(error) ? [] : [made("p", error.message, "wrong")]));
  }
  if (shown === part("answer")) shown.append(waysBack());
  running = null;
  part("begin").ariaDisabled = null;
  part("cancel").hidden = true;
}

part("cancel").addEventListener("click", () => {
  if (running) send("DELETE", `/answers/${running}`).catch(() => {});
});

// The headline without the word that stands in the mark before it.
const said = ({word, headline}) => {
  const rest = headline.startsWith(`${word}: `) ? headline.slice(word.length + 2) : headline;
  return rest[0].toUpperCase() + rest.slice(1);
};

// What to do on this page; the words of the command, which may name its options, are in the details.
function failure({code, message}, about) {
  const remedy = texts[`error_${code}`];
  const parts = [made("h3", texts.failed), made("p", remedy ? `${about}: ${remedy}` : onPage(message), "wrong")];
  return [...parts, explained(code, "error", remedy && message)];
}

// Without the sentences about the command line and its files: what they do is done by buttons here.
const COMMAND = /\[signals\]|--\w|vehicle file|oncenter \w+( [A-Z-]|$)|traffic_side|`/;
function onPage(text, adds = true) {
  const sentences = text.split(/(?<=[.:;]) /), kept = sentences.filter((each) => !COMMAND.test(each));
  if (kept.length === sentences.length) return text;
  const isOfOwn = part("truck").selectedOptions[0].parentElement.dataset.group === "yours"; // it has these buttons
  if (adds && isOfOwn) kept.push(texts.by_buttons);
  return (kept.length ? kept : [text]).join(" ").replace(/[:;] (?=“|$)/, ". ");
}

const filled = (text, ...values) => values.reduce((rest, value) => rest.replace("{}", value), text);

// The side without a sign, and which of both intervals is which.
function inPlainWords({offset: {value, status, ci95, ci95_drive: ofDrive}}, {state}) {
  if (status !== "valid" || !ci95 || !ofDrive) return [];
  const lines = [], between = (ends) => ends.map(signed).join(` ${texts.to} `) + " deg";
  if (["undecided", "over"].includes(state)) lines.push(filled(texts.straight, Math.abs(value).toFixed(1), texts[value > 0 ? "to_left" : "to_right"]));
  lines.push(filled(texts.sure, between(ofDrive), between(ci95)));
  if (state === "undecided") lines.push(texts.near_limit);
  return lines.map((line) => made("p", line, "note"));
}

function show(key, answer, truck, names) {
  const {verdicts: [first, ...others], findings} = answer;
  const verdict = made("div", "", `verdict ${first.state}`);
  verdict.append(made("small", `${truck.title} · ${names}`), made("span", `${marks[first.state]} ${first.word}`, "state"), made("h3", said(first)));
  for (const [text, name] of [[first.action, "action"], [first.note, "note"]]) if (text) verdict.append(made("p", onPage(text), name));
  verdict.append(...inPlainWords(answer, first));
  const list = made("ul", "", "others");
  for (const {about, state, word, headline, action} of others) {
    const row = made("li");
    row.append(made("span", `${marks[state]} ${word}`, `state ${state}`), ` ${about}: ${said({word, headline})} ${state === "ok" ? "" : onPage(action)}`);
    list.append(row);
  }
  if (isOwn(truck) && former.some(({of}) => of === driveOf(answer))) verdict.append(made("p", texts.counted, "note"));
  const shown = [verdict, list, warnings(findings), offers(texts.report, key, `${truck.title} ${(answer.start_time ?? "").slice(0, 10)}`.trim(), true)];
  shown.push(...comparing(key, truck, driveOf(answer)));
  answers.set(key, {truck: truckOf(truck), drive: driveOf(answer), text: `${answer.log}: ${first.headline}`});
  return shown;
}

// Before and after: the drive before is another one of this truck, of this page or of an earlier day.
function comparing(after, truck, drive) {
  const label = made("label", texts.compare), choice = made("select"), button = made("button", texts.compared);
  const before = new Map(); // by drive: the newest answer
  if (isOwn(truck)) {
    for (const each of former) before.set(each.of, {text: each.text, given: {truck: truck.name, drive: each.drive}});
  } else for (const [key, each] of answers) if (each.truck === truckOf(truck)) before.set(each.drive, {text: each.text, given: {before: key}});
  before.delete(drive);
  if (!before.size) return [];
  for (const [each, {text}] of before) {
    const option = made("option", text);
    option.value = each;
    choice.append(option);
  }
  label.append(choice);
  const shown = made("div"), parts = made("div");
  shown.setAttribute("aria-live", "polite");
  button.addEventListener("click", () => {
    begin("/comparisons", {...before.get(choice.value).given, after}, (key, {headline, action}) => {
      const verdict = made("div", "", "verdict");
      verdict.append(made("h3", headline), made("p", action, "action"));
      return [verdict, offers(texts.certificate, key, texts.compared, false)];
    }, shown, texts.compared);
  });
  parts.append(label, button, shown);
  return [parts];
}
