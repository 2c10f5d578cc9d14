// Shows the newest state of the session: words and marks here, the figures are BokehJS's.
const at = (id) => document.getElementById(id);
const texts = JSON.parse(at("texts").textContent);
const filled = (text, given) => text.replace(/\{(\w+)\}/g, (_, name) => given[name]);
const SVG = "http://www.w3.org/2000/svg";
const SCALES_DEG = [10, 30, 90, 270, 900], HALF_PX = 100, KEEP_WIDE_MS = 3000, OFF_DEG = 30;
let newest = Date.now(), events = null, finished = false, scale = 0, neededMs = 0;

const svg = (name, attributes, parent, text) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text) made.textContent = text;
  parent.append(made);
};
for (let k = 0; k < 24; k++) svg("line", {y1: -106, y2: k % 6 ? -100 : -94, transform: `rotate(${15 * k})`}, document.querySelector(".dial"));

// The scale grows at once with the angles, and shrinks after a while. A measured angle with a large offset, as of whole
// turns, stays at the end of the ruler.
const ruler = ({measured, corrected, estimated}) => {
  const near = corrected === null || Math.abs(measured - corrected) < OFF_DEG ? measured : null;
  const farthest = Math.max(...[near, corrected, estimated].map(Math.abs));
  const needed = SCALES_DEG.find((deg) => farthest <= deg) ?? SCALES_DEG.at(-1);
  if (needed >= scale) neededMs = Date.now();
  if (needed === scale || (needed < scale && Date.now() - neededMs < KEEP_WIDE_MS)) return;
  scale = needed;
  const drawn = document.querySelector(".ruler");
  drawn.replaceChildren();
  for (let tenth = -10; tenth <= 10; tenth++) {
    const x = -HALF_PX * tenth / 10;
    svg("line", {x1: x, x2: x, y1: 0, y2: tenth % 5 ? 12 : 24, class: tenth ? "" : "zero"}, drawn);
    if (tenth % 5) continue;
    const [side, anchor, at] = tenth === 10 ? [` ${texts.left}`, "start", -110] : tenth === -10 ? [` ${texts.right}`, "end", 110] : ["", "middle", x];
    svg("text", {x: at, y: 37, "text-anchor": anchor}, drawn, Math.abs(scale * tenth / 10) + side);
  }
};
const px = (deg) => -HALF_PX * Math.max(-1.06, Math.min(1.06, deg / scale));

const put = (id, text) => { if (at(id).textContent !== text) at(id).textContent = text; };
const degrees = (value) => value === null ? "—" : (value < 0 ? "−" : "+") + Math.abs(value).toFixed(1);
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const list = (id, lines, make) => {
  const key = JSON.stringify(lines);
  if (at(id).dataset.shown === key) return;
  at(id).dataset.shown = key;
  at(id).replaceChildren(...lines.map(make));
};
const element = (name, text, className) => {
  const made = document.createElement(name);
  made.textContent = text;
  if (className) made.className = className;
  return made;
};

const show = (now) => {
  newest = Date.now();
  finished = now.phase === "ended";
  put("finished", capital(now.finished));
  at("finished").hidden = !now.finished;
  at("gate").hidden = finished;
  list("verdict", now.verdict ? [now.verdict] : [], ({headline, action}) => {
    const made = document.createDocumentFragment();
    made.append(headline);
    if (action) made.append(element("span", action));
    return made;
  });
  at("verdict").className = `verdict ${now.verdict?.state ?? ""}`;
  at("verdict").hidden = !now.verdict;
  put("truck", now.truck);
  put("bus", now.bus);
  put("offset-value", now.offset.value);
  at("offset").className = `offset ${now.offset.of_drive ? now.offset.status : "none"}`;
  put("offset-unit", now.offset.but ? `${texts.deg}, ${now.offset.but}` : texts.deg);
  at("offset-unit").hidden = !now.offset.of_drive;
  put("interval", now.offset.of_drive ? filled(texts.of_drive, now.offset) : texts.no_offset);
  put("beside", now.offset.beside ? filled(texts.beside, now.offset) : "");
  at("beside").hidden = !now.offset.beside;
  put("status", now.offset.status);
  at("status").hidden = now.offset.status === "unobservable";
  at("status").className = `status ${now.offset.status}`;
  put("gate", capital(now.gate.why));
  at("gate").classList.toggle("counts", now.gate.counts);
  put("fault", now.fault);
  at("fault").hidden = !now.fault;
  put("losses", now.losses);
  at("losses").hidden = !now.losses;
  ruler(now.angles);
  for (const [name, value] of Object.entries(now.angles)) {
    put(name, degrees(value));
    at(`mark-${name}`).style.visibility = value === null ? "hidden" : "visible";
    if (value !== null) at(`mark-${name}`).setAttribute("transform", `translate(${px(value)} 0)`);
  }
  const half = now.estimated_half_width;
  put("estimated-unit", half === null ? texts.deg : `± ${half.toFixed(1)} ${texts.deg}`);
  const [left, right] = half === null ? [0, 0] : [px(now.angles.estimated + half), px(now.angles.estimated - half)];
  at("band-estimated").setAttribute("x", left);
  at("band-estimated").setAttribute("width", right - left);
  const turned = now.angles.corrected ?? now.angles.measured ?? 0;
  at("wheel-turned").setAttribute("transform", `rotate(${-turned})`);
  at("wheel").classList.toggle("unknown", now.angles.corrected === null);
  put("speed", now.speed_km_h === null ? "—" : now.speed_km_h.toFixed(0));
  for (const [side, share] of Object.entries(now.flanks)) {
    at(`flank-${side}`).style.width = `${100 * share}%`;
    put(`flank-${side}-share`, `${Math.round(100 * share)} %`);
  }
  const needed = now.missing.length ? now.missing : [finished ? texts.nothing_needed_at_end : texts.nothing_needed];
  list("missing", needed, (line) => element("li", capital(line), now.missing.length ? "" : "done"));
  list("quantities", Object.entries(now.quantities), ([name, text]) => {
    const row = document.createElement("tr");
    row.append(element("th", capital(name)), element("td", text));
    return row;
  });
  list("findings", now.findings, (finding) => {
    const line = element("li", "", finding.severity);
    line.append(element("b", finding.severity), ` ${finding.text}`);
    return line;
  });
  at("no-findings").hidden = now.findings.length > 0;
  put("traffic", now.traffic);
  list("said", now.said, (line) => element("li", line));
  requestAnimationFrame(() => dispatchEvent(new CustomEvent("shown", {detail: {number: now.number, frame_s: now.frame_s}})));
};

// The new values of one figure, by the identifiers of its models.
const redraw = (picture) => {
  for (const [id, values] of Object.entries(picture)) {
    for (const [name, column] of Object.entries(values.data ?? {})) values.data[name] = column.map((value) => value ?? NaN);
    Bokeh.documents.map((document) => document.get_model_by_id(id)).find((model) => model).setv(values);
  }
};

const follow = async () => {
  for (const figure of JSON.parse(at("figures").textContent)) await Bokeh.embed.embed_item(figure);
  restyle();
  events = new EventSource("events");
  events.onmessage = ({data}) => show(JSON.parse(data));
  events.addEventListener("picture", ({data}) => redraw(JSON.parse(data)));
  events.onerror = () => events.close(); // the page asks below whether the server is back
};
follow();

// Without a new state for a while, unless the session has ended: the page says so, and reloads when the server is back.
setInterval(async () => {
  const lost = !finished && Date.now() - newest > 2500;
  at("lost").hidden = !lost;
  if (!lost) return;
  let status = 0; // no server
  try {
    ({status} = await fetch(location.href, {cache: "no-store"}));
  } catch { /* not yet */ }
  const isCut = events?.readyState === EventSource.CLOSED || Date.now() - newest > 10000; // a slow one is not cut
  if (status === 200 && isCut) location.reload();
  put("lost", status === 403 ? texts.other_session : filled(texts.lost, {time: new Date(newest).toLocaleTimeString("sv-SE")}));
}, 1000);
