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
    response = await fetch(path, {method, signal, body: content === undefined ? undefined : JSON.stringify(content)});
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
    if (!atField(error)) part(wrong).textContent = error.message;
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
        await fetch(`/logs/${key}`, {method: "PUT", body: file});
        sent.set(file, key);
      }
      databases.push(sent.get(file));
    }
    const form = Object.fromEntries(new FormData(part("form")));
    await chooseSignals({...form, databases, logs: wholeLogs()}, form.name, part("truck-state"));
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
  option.selected = true;
  part("truck").dispatchEvent(new Event("change"));
  part("other").open = false;
  part("truck").focus();
}

function add(file) {
  const row = made("li"), name = made("span", file.name), state = made("span"), button = made("button", texts.cancel);
  const progress = made("progress");
  button.type = "button";
  button.setAttribute("aria-label", `${texts.cancel}: ${file.name}`);
  row.append(name, state, button, progress);
  part("logs").append(row);
  const log = {key: null, request: new XMLHttpRequest(), isWhole: false};
  logs.set(row, log);
  const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
  const drop = () => {
    logs.delete(row);
    row.remove();
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

const answers = new Map(); // by key: the logs and the verdict, for a comparison

part("begin").addEventListener("click", () => {
  const chosen = part("truck").selectedOptions[0];
  const given = {group: chosen.parentElement.dataset.group ?? chosen.value, name: chosen.value};
  for (const field of ["limit", "applied"]) given[field] = part(field).value;
  given.logs = [...logs.values()].map((log) => log.key);
  const names = [...logs.keys()].map((row) => row.firstChild.textContent).join(", ");
  begin("/answers", given, (key, said) => show(key, said, names)).then(listDrives);
});

const HINTED = ["missing_signal", "not_j1939", "unit_missing"]; // errors of a network with other names

// One run of a command: what it says is shown by `done`.
async function begin(path, given, done) {
  const shown = part("answer");
  if (part("begin").ariaDisabled) return; // not disabled: that would take the focus of a keyboard away
  part("begin").ariaDisabled = "true";
  shown.replaceChildren(made("p", texts.reading), made("progress"));
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
    else if (state === "failed") {
      const hint = HINTED.includes(said.code) ? [made("p", texts.signals_hint)] : [];
      shown.replaceChildren(made("h3", texts.failed), made("p", said.message, "wrong"), ...hint, explained(said.code, "error"));
    }
    else shown.replaceChildren(...done(key, said));
  } catch (error) {
    shown.replaceChildren(...(atField(error) ? [] : [made("p", error.message, "wrong")]));
  }
  shown.append(waysBack());
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

function show(key, {verdicts: [first, ...others], findings}, names) {
  const verdict = made("div", "", `verdict ${first.state}`);
  verdict.append(made("span", `${marks[first.state]} ${first.word}`, "state"), made("h3", said(first)));
  for (const [text, name] of [[first.action, "action"], [first.note, "note"]]) if (text) verdict.append(made("p", text, name));
  const list = made("ul", "", "others");
  for (const {about, state, word, headline, action} of others) {
    const row = made("li");
    row.append(made("span", `${marks[state]} ${word}`, `state ${state}`), ` ${about}: ${said({word, headline})} ${state === "ok" ? "" : action}`);
    list.append(row);
  }
  const shown = [verdict, list, warnings(findings), offers(texts.report, key, true)];
  if (answers.size || former.length) shown.push(comparing(key));
  answers.set(key, `${names}: ${first.headline}`);
  return shown;
}

// Before and after: the drive before is one of the former answers.
function comparing(after) {
  const label = made("label", texts.compare), choice = made("select"), button = made("button", texts.compared);
  for (const [key, name] of answers) {
    const option = made("option", name);
    option.value = key;
    choice.append(option);
  }
  for (const {drive, text} of former.filter(({text}) => ![...answers.values()].includes(text))) {
    const option = made("option", text);
    [option.value, option.dataset.drive] = [drive, drive];
    choice.append(option);
  }
  label.append(choice);
  button.addEventListener("click", () => {
    const {drive} = choice.selectedOptions[0].dataset;
    const before = drive ? {truck: part("truck").value, drive} : {before: choice.value};
    begin("/comparisons", {...before, after}, (key, {headline, action}) => {
      const verdict = made("div", "", "verdict");
      verdict.append(made("h3", headline), made("p", action, "action"));
      return [verdict, offers(texts.certificate, key, false)];
    });
  });
  const parts = made("div");
  parts.append(label, button);
  return parts;
}
