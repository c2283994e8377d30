// Self-test, calibration and experiments: started by a button that is held, led by prompts in huge type, judged in words.

import { element } from "/elements.js";

const ENDS = {
  passed: ["holds", "✓", "passed"],
  failed: ["fails", "✗", "did not pass"],
  cancelled: ["fails", "■", "was cancelled"],
  stopped: ["fails", "■", "was stopped: the force is off"],
  "broken off": ["fails", "✗", "could not go on"],
};
const MARKS = { pass: "✓", fail: "✗", "not judged": "–" };

export class Procedures {
  /** `boxes`: elements by name; `axis()` the chosen one; `begun()`: this page has started one. */
  constructor(boxes, ask, safety, axis, say, begun) {
    Object.assign(this, { boxes, ask, safety, axis, say, begun });
    this.starts = [];
    boxes.answer.onclick = () => this.answer();
    boxes.cancel.onclick = () => this.send({ type: "cancel" });
    addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !this.canAnswer || safety.held.has(event.target)) return;
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.answer();
    }, { capture: true });
  }

  get running() { return this.state?.phase === "running"; }
  get canAnswer() { return this.running && this.state.prompt !== null && this.state.client === this.client; }
  /** Started from here, and under way. */
  get mine() { return this.running && this.state.client === this.client; }

  show(device) {
    this.starts = [];
    this.boxes.list.replaceChildren(...device.procedures.map((one) => this.card(one)));
    this.allow(this.usable);
  }

  card(one) {
    const hand = one.hand && element("input", { type: "checkbox" });
    const trials = one.trials && element("input", { type: "number", min: 1, max: 100, value: one.trials, className: "trials" });
    const start = element("button", { type: "button", id: `start-${one.name}` }, element("span", {}, "Hold to start"));
    start.setAttribute("aria-describedby", `before-${one.name}`);
    this.safety.hold(start, () => this.start({
      name: one.name, ...(hand && { hand: hand.checked }), ...(trials && { trials: trials.valueAsNumber || one.trials }),
    }));
    this.starts.push(start);
    return element("article", { className: "procedure" },
      element("h3", {}, one.title),
      element("p", { id: `before-${one.name}` }, one.before),
      ...(hand ? [element("label", {}, hand, ` With my hand: ${one.hand}`)] : []),
      ...(trials ? [element("label", {}, trials, " touches of each wall")] : []),
      start);
  }

  /** Whether an axis can be armed from here now. */
  allow(usable) {
    this.usable = usable;
    for (const start of this.starts) start.disabled = !usable || this.running;
  }

  async send(message) {
    const reply = await this.ask(message);
    this.say(reply.message, reply.ok);
    this.boxes.said.textContent = reply.ok ? "" : reply.message;
    return reply.ok;
  }

  async start(wanted) {
    if (await this.send({ type: "procedure", axis: this.axis(), ...wanted })) this.begun();
  }

  answer() {
    if (this.canAnswer) this.send({ type: "answer", prompt: this.state.prompt });
  }

  /** The message "procedure"; `client`: who this page is. */
  heard(state, client) {
    this.state = state;
    this.client = client;
    this.showPrompt();
    this.showResult();
    this.allow(this.usable);
  }

  /** Nobody says any more what goes on. */
  lost() {
    this.state = null;
    this.boxes.prompt.hidden = true;
  }

  showPrompt() {
    const { prompt, name, words, answer, other } = this.boxes;
    prompt.hidden = !this.running;
    if (!this.running) return;
    const text = this.state.instruction ?? this.state.progress ?? "begins";
    // "F_MC = 1 N: press ...": what it is about in front, smaller.
    const [, about, rest] = text.match(/^(.{1,60}?): (.+)$/s) ?? [null, "", text];
    name.textContent = [this.state.title, about].filter(Boolean).join(": ");
    words.textContent = rest;
    answer.hidden = !this.canAnswer;
    other.textContent = this.state.client === this.client ? "" : "Started from another page, which answers its prompts. Anybody may cancel, or stop.";
  }

  showResult() {
    const { result } = this.boxes;
    result.hidden = this.running && !this.state.findings.length;
    if (result.hidden) return;
    const [kind, mark, words] = ENDS[this.state.phase] ?? ["", "", "so far"];
    const conclusion = this.state.words ? element("p", {}, this.state.words) : "";
    result.replaceChildren(
      element("p", { className: `verdict ${kind}` }, element("b", {}, `${mark} ${this.state.title} ${words}`.trim())), conclusion, this.offer(),
      ...this.state.notes.map((note) => element("p", { className: "quiet" }, note)),
      ...this.state.findings.map((one) => element("div", { className: `finding ${one.verdict === "fail" ? "fails" : ""}` },
        element("b", {}, `${MARKS[one.verdict]} ${one.name.replaceAll("_", " ")}`), element("span", {}, one.words))));
  }

  /** What becomes of parameters that it has changed. */
  offer() {
    if (!this.state.changed) return "";
    const button = (keep, words) => {
      const made = element("button", { type: "button", className: "plain", id: keep ? "keep" : "put-back" }, words);
      made.onclick = () => this.send({ type: "keep", keep });
      return made;
    };
    return element("p", { className: "row" }, button(true, "Save the result"), button(false, "Put everything back"),
      element("span", { className: "quiet" }, `${this.state.changed} parameters were changed; without a choice they last until the device restarts. Save keeps all parameters.`));
  }
}
