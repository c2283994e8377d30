// Puts the page together: what the stream says goes to those who show it.

import { Controls } from "/controls.js";
import { Criteria } from "/criteria.js";
import { Comparison } from "/comparison.js";
import { offer, tableOf } from "/export.js";
import { LoopView } from "/loop_view.js";
import { MapView } from "/map_view.js";
import { Procedures } from "/procedures.js";
import { Rows } from "/rows.js";
import { Safety } from "/safety.js";
import { Scope } from "/scope.js";
import { Stream } from "/stream.js";
import { followTheme } from "/theme.js";
import { digits } from "/units.js";

const MAPS = { "guard.damping": "damping of the device", "wall.damping": "damping of the wall", "wall.magnetic_coefficient": "magnetic coefficient" };
const NEWS_S = 20;  // a page that is reloaded says what that did
const at = (id) => document.getElementById(id);

let axis = 0, device = null, state = null, values = null, client = null, connected = false;
let rows = [];
const curves = new Map(), judgements = new Map(), maps = new Map();
let changed = true;

function say(text, ok = true) {
  at("said").textContent = text;
  at("said").classList.toggle("bad", !ok);
}

const heard = {
  welcome(message) { client = message.client; },
  device(message) {
    const first = !device;
    device = message;
    rows = Array.from({ length: message.axes }, () => new Rows(message.tick_rate_hz));
    at("device").textContent = [message.address, message.identification.product_name, message.identification.revision].filter(Boolean).join("  ");
    at("axis").replaceChildren(...rows.map((_, i) => new Option(String(i), String(i))));
    at("axis").value = String(axis);
    scope.show(message);
    procedures.show(message);
    chooseAxis(axis);
    if (first) document.body.dataset.ready = "yes";
  },
  parameters(message) {
    values = message.values;
    showControls();
  },
  state(message) {
    state = message;
    showState();
    showControls();
  },
  stopped(message) {
    if (Date.now() / 1e3 - message.time > NEWS_S) return;
    const trouble = message.trouble ? ` ${message.trouble}` : "";
    banner(`Stopped: ${message.why}. The device had answered after ${digits(1e3 * message.seconds, 2)} ms.${trouble}`, Boolean(message.trouble));
  },
  curve(message) { curves.set(message.axis, message); },
  judgement(message) {
    judgements.set(message.axis, message);
    showStability();
  },
  map(message) { maps.set(`${message.axis} ${message.up.name}`, message); },
  rows(message) { message.axes.forEach((one) => rows[one.axis]?.take(message.tick, one)); },
  capture(message) { scope.heard(message); },
  procedure(message) {
    procedures.heard(message, client);
    showState();
  },
};

const token = location.hash.slice(1);
const stream = new Stream(token, (message) => {
  heard[message.type]?.(message);
  changed = true;
}, (now) => {
  connected = now;
  if (!now) {
    state = null;
    procedures.lost();
  }
  showState();
  if (now) wantMap();
});
const ask = (message) => stream.ask(message);
const safety = new Safety({ arm: at("arm"), words: at("arm-words"), stop: at("stop") }, stream, () => axis, say);
const procedures = new Procedures({
  list: at("procedure-list"), said: at("procedure-said"), result: at("result"), prompt: at("prompt"), name: at("prompt-name"), words: at("prompt-words"),
  answer: at("answer"), cancel: at("cancel"), other: at("prompt-other"),
}, ask, safety, () => axis, say, () => view("procedures"));
const controls = new Controls(at("sliders"), ask, say);
const criteria = new Criteria(at("criteria"), async (name, value) => {
  const reply = await ask({ type: "set", axis, values: { [name]: value } });
  say(reply.message, reply.ok);
});
const loop = new LoopView(at("loop-canvas"), at("loop-values"));
const map = new MapView(at("map-canvas"));
const scope = new Scope({
  plots: at("plots"), kinds: document.querySelectorAll("[data-scope]"), capture: at("capture"), trigger: at("trigger"),
  level: at("level"), span: at("span"), signal: at("spectrum-signal"), words: at("scope-words"), captureControls: at("capture-controls"),
}, ask);
const comparison = new Comparison({
  files: at("recording-files"), area: at("recordings"), align: at("align"), said: at("recordings-said"), empty: at("recordings-empty"),
  legend: at("legend"), overDistance: at("over-distance"), overTime: at("over-time"),
}, () => axis, () => wall() ?? { position: 0, side: 1 });

function full(name) { return axis ? `axis${axis}.${name}` : name; }
function present(name) { return values?.[name]?.value ?? NaN; }
function wall() {
  return values && { position: present(full("wall.position")), side: Number(present(full("wall.side"))), limit: present(full("force.limit")) };
}
function thisAxis() { return state?.axes.find((one) => one.axis === axis); }

function banner(text, bad) {
  at("banner").hidden = !text;
  at("banner").textContent = text;
  at("banner").classList.toggle("bad", bad);
}

function showState() {
  const box = at("state");
  const one = thisAxis();
  const reachable = connected && state?.link.connected;
  const kind = !reachable ? "lost" : !one?.present ? "absent" : one.armed ? "armed" : one.fault ? "fault" : one.state === "quick_stop_active" ? "stopped" : "disarmed";
  box.dataset.state = kind;
  at("state-words").textContent = !token ? "No token" : !connected ? "kmax view cannot be reached" : !state ? "Connecting"
    : !state.link.connected ? "Link lost" : one?.words ?? "No such axis";
  at("state-detail").textContent = !token ? "Open the whole address that kmax view printed."
    : !connected ? "Trying again. A device that was armed from here has been disarmed, or link.timeout takes its force."
      : !state ? "" : !state.link.connected ? `${state.link.trouble}. Trying again.` : detail(one);
  at("link").textContent = reachable ? `round trip ${digits(1e3 * state.link.round_trip_s, 2)} ms` : "";
  const saved = at("saved");
  const unsaved = state?.unsaved;
  saved.textContent = unsaved === null || unsaved === undefined ? "" : unsaved ? `${unsaved} not saved` : "saved";
  saved.classList.toggle("attention", Boolean(unsaved));
  const mine = procedures.mine || Boolean(state?.axes.some((each) => each.armed && each.armed_by === client));
  const armed = Boolean(one?.armed);
  safety.show(armed, mine, Boolean(reachable) && (armed || !procedures.running));
  procedures.allow(Boolean(reachable) && !state.axes.some((each) => each.armed));
  changed = true;
}

function detail(one) {
  if (one?.trouble) return one.fault ? `${one.trouble}. ` : one.trouble;
  if (one?.armed && one.armed_by !== client) return one.armed_by === null ? "Armed by another program." : "Armed by another page.";
  return state.link.rows_trouble ?? "";
}

function showControls() {
  if (!values || !device) return;
  const one = thisAxis();
  controls.show(values, Boolean(one?.armed));
  at("clear").hidden = !one?.fault;
}

function showStability() {
  const judgement = judgements.get(axis);
  if (judgement) criteria.show(judgement);
}

function wantMap() {
  if (device) ask({ type: "map", axis, up: at("map-up").value });
}

function chooseAxis(chosen) {
  axis = chosen;
  scope.axis = chosen;
  controls.build(device, axis);
  showState();
  showControls();
  showStability();
  wantMap();
}

at("map-up").replaceChildren(...Object.entries(MAPS).map(([name, label]) => new Option(label, name)));
at("map-up").onchange = wantMap;
at("axis").onchange = () => chooseAxis(Number(at("axis").value));
at("revert").onclick = async () => {
  const reply = await ask({ type: "revert" });
  say(reply.message, reply.ok);
};
at("save").onclick = async () => {
  const reply = await ask({ type: "save" });
  say(reply.message, reply.ok);
};
at("clear").onclick = async () => {
  const reply = await ask({ type: "clear", axis });
  say(reply.message, reply.ok);
};
at("copy").onclick = async () => {
  const command = controls.command(device.address);
  try {
    await navigator.clipboard.writeText(command);
    say(`copied: ${command}`);
  } catch {
    say(command);
  }
};
/** What the scope holds, as a table; null: nothing yet, which is said. */
function scopeTable() {
  if (device && values && rows[axis].length) return tableOf({ device, axis, values, rows: rows[axis], taken: scope.kind === "capture" ? scope.captured ?? null : null });
  for (const words of [at("said"), at("recordings-said")]) words.textContent = "the scope holds nothing yet";
  return null;
}

function view(name) {
  document.body.dataset.view = name;
  for (const button of document.querySelectorAll("nav button")) button.setAttribute("aria-pressed", String(button.dataset.view === name));
  changed = true;
}

for (const button of document.querySelectorAll("nav button")) button.onclick = () => view(button.dataset.view);
at("export").onclick = () => {
  const table = scopeTable();
  if (table) offer(table);
};
at("take").onclick = () => {
  const table = scopeTable();
  if (table) comparison.add(table.name, table.text);
};
at("banner").onclick = () => banner("", false);
addEventListener("resize", () => { changed = true; });
followTheme(at("theme"), () => {
  changed = true;
  scope.rebuild();
  showStability();
  comparison.draw();
});
showState();

// Thirty pictures a second, and only when something is new.
let drawn = 0;
function draw(now) {
  requestAnimationFrame(draw);
  if (!changed || now - drawn < 30 || !device) return;
  changed = false;
  drawn = now;
  if (document.body.dataset.view !== "live") return;
  loop.draw(curves.get(axis), wall(), rows[axis]);
  map.draw(maps.get(`${axis} ${full(at("map-up").value)}`), present);
  scope.draw(rows[axis], now);
}
requestAnimationFrame(draw);
