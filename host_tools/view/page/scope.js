// The scope: four signals rolling, a capture at the full rate, or a spectrum whose peak is named. uPlot draws; where this
// program was built without it, the newest values stand there as text.

import { SIGNALS } from "/rows.js";
import { spectrum } from "/spectrum.js";
import { colour } from "/theme.js";
import { digits, shownUnit, steady, toShown, withUnit } from "/units.js";

const WINDOW_S = 1;
const SPECTRUM_ROWS = 2048;
const SAMPLES = 500;  // of four channels: read over CAN in less than half of link.timeout
const LEVELLED = ["force", "velocity"];

async function uplot() {
  try {
    const [drawing] = await Promise.all([import("/uplot.js"), loadStyle("/uplot.css")]);
    return drawing.default;
  } catch {
    return null;
  }
}

/** A range that holds both, is no narrower than `least`, and has a little room. */
function withRoom(low, high, least) {
  const missing = Math.max(0, least - (high - low)) / 2, room = 0.06 * Math.max(high - low, least);
  return [low - missing - room, high + missing + room];
}

function loadStyle(href) {
  return new Promise((resolve, reject) => {
    document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href, onload: resolve, onerror: reject }));
  });
}

export class Scope {
  constructor(boxes, ask) {
    this.boxes = boxes;
    this.ask = ask;
    this.kind = "rolling";
    this.charts = [];
    for (const button of boxes.kinds) button.onclick = () => this.choose(button.dataset.scope);
    boxes.capture.onclick = () => this.capture();
    boxes.trigger.onchange = () => { boxes.level.parentElement.hidden = !LEVELLED.includes(boxes.trigger.value); };
    boxes.signal.onchange = () => this.rebuild();
    uplot().then((UPlot) => {
      this.UPlot = UPlot;
      this.ready = true;
      this.rebuild();
    });
    new ResizeObserver(() => this.rebuild()).observe(boxes.plots);
  }

  show(device) {
    this.device = device;
    this.boxes.trigger.replaceChildren(...device.capture.triggers.map((name) => new Option(name, name)));
    this.boxes.span.replaceChildren(...[1, 4, 16, 64].map((ticks) =>
      new Option(`${digits((1e3 * SAMPLES * ticks) / device.tick_rate_hz)} ms`, ticks)));
    this.boxes.signal.replaceChildren(
      ...Object.keys(SIGNALS).map((name) => new Option(`${name}, rolling`, `rows ${name}`)),
      ...Object.keys(SIGNALS).map((name) => new Option(`${name}, 20 kHz`, `captured ${name}`)));
    this.boxes.signal.value = "rows force";
  }

  choose(kind) {
    this.kind = kind;
    for (const button of this.boxes.kinds) button.setAttribute("aria-pressed", String(button.dataset.scope === kind));
    this.boxes.captureControls.hidden = kind !== "capture";
    this.boxes.signal.parentElement.hidden = kind !== "spectrum";
    this.boxes.words.textContent = "";
    this.rebuild();
  }

  async capture() {
    const trigger = this.boxes.trigger.value;
    const level = LEVELLED.includes(trigger) ? { level: Number(this.boxes.level.value) } : {};
    const reply = await this.ask({
      type: "capture", axis: this.axis, trigger, ...level, samples: SAMPLES, pre_trigger: trigger === "now" ? 0 : SAMPLES / 4,
      interval: Number(this.boxes.span.value),
      channels: Object.keys(SIGNALS),
    });
    if (!reply.ok) this.boxes.words.textContent = reply.message;
  }

  /** The message "capture". */
  heard(message) {
    if (message.phase === "complete") {
      this.captured = message;
      if (this.kind === "capture") this.rebuild();
      else if (this.kind === "spectrum") this.drawn = 0;
      this.progress = `${message.samples} samples, trigger: ${message.trigger}`;
    } else {
      this.progress = { waiting: "waiting for the trigger", failed: message.message }[message.phase]
        ?? `${message.phase} ${message.done} of ${message.all}`;
    }
    if (this.kind === "capture") this.boxes.words.textContent = this.progress;
  }

  rebuild() {
    for (const chart of this.charts) chart.destroy();
    this.charts = [];
    this.boxes.plots.replaceChildren();
    if (!this.ready || !this.UPlot) return;
    const names = this.kind === "spectrum" ? ["spectrum"] : Object.keys(SIGNALS);
    const box = this.boxes.plots.getBoundingClientRect();
    const columns = names.length === 1 ? 1 : box.width > 700 ? 4 : 2;
    this.boxes.plots.style.setProperty("--columns", columns);
    const width = Math.floor(box.width / columns) - 8;
    const height = Math.max(90, Math.floor(box.height / Math.ceil(names.length / columns)) - 6);
    for (const name of names) this.charts.push(this.chart(name, width, height));
    if (this.kind === "capture") this.drawCapture();
  }

  chart(name, width, height) {
    const holder = document.createElement("div");
    this.boxes.plots.append(holder);
    const place = Math.max(0, Object.keys(SIGNALS).indexOf(name));
    const unit = SIGNALS[name]?.unit ?? "";
    const axis = { stroke: () => colour("text-quiet"), grid: { stroke: () => colour("grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    const across = { rolling: "s", capture: "ms", spectrum: "Hz" }[this.kind];
    return new this.UPlot({
      width, height, legend: { show: false }, cursor: { show: this.kind !== "rolling", drag: { x: true, y: false } },
      title: name === "spectrum" ? undefined : `${name} (${shownUnit(unit)})`,
      scales: { x: { time: false }, y: { range: (_, low, high) => withRoom(low, high, SIGNALS[name]?.least ?? 0) } },
      series: [{}, { stroke: () => colour(`line-${place + 1}`), width: 1.5, points: { show: false } }],
      axes: [{ ...axis, size: 26, values: (_, ticks) => ticks.map((tick) => `${digits(tick, 4)}${tick === ticks.at(-1) ? ` ${across}` : ""}`) },
        { ...axis, size: 48, values: (_, ticks) => ticks.map((tick) => digits(tick, 4)) }],
    }, [[], []], holder);
  }

  /** Thirty times a second at most; `rows` are those of the chosen axis. */
  draw(rows, now) {
    if (!this.ready || !rows) return;
    if (!this.UPlot) return this.asText(rows);
    const interval = this.kind === "spectrum" ? 250 : 50;
    if (now - (this.drawn ?? 0) < interval) return;
    this.drawn = now;
    if (this.kind === "rolling") this.drawRolling(rows);
    if (this.kind === "spectrum") this.drawSpectrum(rows);
  }

  asText(rows) {
    if (!rows.length) return;
    const place = rows.at(0);
    this.boxes.plots.className = "as-text";
    this.boxes.plots.textContent = Object.entries(SIGNALS)
      .map(([name, { unit }]) => `${name} ${steady(toShown(rows[name][place], unit), 3)} ${shownUnit(unit)}`).join("   ");
  }

  drawRolling(rows) {
    const n = rows.within(WINDOW_S);
    const last = rows.tick[rows.at(0)];
    const time = rows.last("tick", n).map((tick) => (tick - last) / rows.tickRate);
    Object.entries(SIGNALS).forEach(([name, { unit }], i) =>
      this.charts[i]?.setData([time, rows.last(name, n).map((value) => toShown(value, unit))]));
    this.boxes.words.textContent = n > 2 ? `${digits(1 / rows.period, 3)} rows a second` : "";
  }

  drawCapture() {
    const taken = this.captured;
    if (!taken) {
      this.boxes.words.textContent = this.progress ?? "a capture shows a moment at up to the full rate";
      return;
    }
    const ms = (1e3 * taken.interval_ticks) / taken.tick_rate_hz;
    Object.entries(SIGNALS).forEach(([name, { unit }], i) => {
      const values = taken.channels.find((channel) => channel.name === name)?.values ?? [];
      this.charts[i]?.setData([values.map((_, k) => (k - taken.trigger_sample) * ms), values.map((value) => toShown(value, unit))]);
    });
  }

  drawSpectrum(rows) {
    const [source, name] = this.boxes.signal.value.split(" ");
    const unit = SIGNALS[name].unit;
    const say = (words) => { this.boxes.words.textContent = words; };
    let samples, rate;
    if (source === "rows") {
      if (!this.device.counted_rows) return say("these rows are not evenly spaced; take a capture, or connect over CAN");
      samples = rows.last(name, Math.min(rows.length, SPECTRUM_ROWS));
      rate = 1 / rows.period;
    } else {
      samples = this.captured?.channels.find((channel) => channel.name === name)?.values ?? [];
      rate = this.captured ? this.captured.tick_rate_hz / this.captured.interval_ticks : NaN;
    }
    const found = spectrum(samples, rate);
    if (!found) return say(source === "rows" ? "too few rows yet" : "there is no capture yet: choose 20 kHz, then Capture");
    this.charts[0]?.setData([found.frequency, found.amplitude.map((value) => toShown(value, unit))]);
    if (found.peak.amplitude < 1e-9) return say(`${name} does not move`);
    say(`peak of ${name} at ${digits(found.peak.frequency, 3)} Hz: ${withUnit(found.peak.amplitude, unit)}`);
  }
}
