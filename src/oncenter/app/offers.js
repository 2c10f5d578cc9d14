"use strict";
// What an answer offers: report, PDF, CSV, explanations of its findings, and the ways back.
const hasBrowser = document.body.dataset.pdf === "true"; // that prints without a window

function link(text, path) {
  const opened = made("a", text, "button");
  [opened.href, opened.target] = [path, "_blank"];
  return opened;
}

// The PDF as a file where a browser of this computer makes it, else by the print dialog of this one.
function pdf(key, name) {
  const printed = () => link(texts.print, `/answers/${key}/report?print=1`);
  if (!hasBrowser) return printed();
  const button = made("button", texts.pdf);
  button.addEventListener("click", async () => {
    if (button.ariaDisabled) return;
    button.ariaDisabled = "true";
    button.textContent = texts.printing;
    try {
      const response = await fetch(`/answers/${key}/pdf`);
      if (!response.ok) throw new Error((await response.json()).message);
      const file = made("a");
      [file.href, file.download] = [URL.createObjectURL(await response.blob()), `oncenter ${name}.pdf`];
      file.click();
      setTimeout(() => URL.revokeObjectURL(file.href), 60e3);
    } catch (error) {
      button.parentElement.after(made("p", error instanceof TypeError ? texts.lost : error.message, "wrong"));
      button.after(" ", printed());
    }
    button.ariaDisabled = null;
    button.textContent = texts.pdf;
  });
  return button;
}

function offers(text, key, name, hasTable) {
  const row = made("p", "", "offers");
  row.append(link(text, `/answers/${key}/report`), pdf(key, name));
  if (hasTable) {
    const table = link(texts.csv, `/answers/${key}/csv`);
    table.download = "oncenter.csv";
    row.append(table);
  }
  return row;
}

// The text of `oncenter explain`, fetched when it is opened.
// Below an own remedy of the page: what was found, without the remedy of the command line.
function explained(code, kind, found) {
  const details = made("details", "", "explained"), words = made("div", texts.reading);
  details.append(made("summary", found ? texts.found : texts.explain), words);
  details.addEventListener("toggle", async () => {
    if (!details.open) return;
    try {
      const {text} = await send("GET", `/explanations/${code}`);
      const section = text.split(`${code} (`).find((each) => each.startsWith(`${kind})`)) ?? text;
      const paragraphs = section.split("\n\n").filter((each) => (found ? /^(What it means|Likely)/ : /^(What|Likely)/).test(each)); // without an example
      words.replaceChildren(...[...(found ? [found] : []), ...paragraphs].map((each) => made("p", onPage(each.replace(/\s+/g, " "), false))));
    } catch (error) {
      words.textContent = error.message;
    }
  });
  return details;
}

function warnings(findings) {
  const list = made("ul", "", "others");
  for (const {code, severity, text} of findings.filter(({severity}) => severity !== "info")) {
    const row = made("li");
    row.append(made("b", `${severity}: `), onPage(text), explained(code, "finding"));
    list.append(row);
  }
  return list;
}

// From every end: another log of this truck, or all anew.
function waysBack() {
  const row = made("p", "", "offers"), log = made("button", texts.another_log), truck = made("button", texts.all_anew);
  const clear = (focused) => {
    for (const button of part("logs").querySelectorAll("button")) button.click();
    part("answer").replaceChildren();
    part("answer").style.minHeight = "";
    part(focused).focus();
  };
  log.addEventListener("click", () => clear("files"));
  truck.addEventListener("click", () => {
    part("truck").value = "";
    emptyForm();
    for (const id of ["limit", "applied"]) {
      part(id).value = "";
      clearSaid(id);
    }
    part("truck").dispatchEvent(new Event("change"));
    clear("files");
  });
  if (part("truck").value) row.append(log);
  row.append(truck);
  return row;
}
