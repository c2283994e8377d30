// Sliders, law and the ceilings of one axis. What is dragged goes to the device as fast as it answers, the newest value
// only; what it refuses goes back to what it was.

import { digits, fromShown, shownUnit, toShown } from "/units.js";

const LAWS = { none: "no force", plain: "plain spring", magnetic: "magnetic", adaptive: "adaptive" };
// `to` in shown units: what a handle needs; a value beyond it makes the slider longer.
const SLIDERS = [
  { name: "wall.stiffness", label: "Stiffness K", to: 10, step: 0.01 },
  { name: "wall.damping", label: "Damping B", to: 20, step: 0.05 },
  { name: "wall.magnetic_coefficient", label: "Field F_MC", to: 5, step: 0.05 },
  { name: "wall.magnetic_length", label: "Field length x₀", to: 10, step: 0.05 },
  { name: "haptic.rate", label: "Haptic rate" },
  { name: "force.limit", label: "Force limit", to: 10, step: 0.1 },
];
const CEILINGS = [
  { name: "wall.stiffness_ceiling", label: "K" },
  { name: "wall.damping_ceiling", label: "B" },
  { name: "force.ceiling", label: "forces" },
];
const QUIET_MS = 400;  // after a change, until the device's own value is shown again

export class Controls {
  /** `ask(message)` resolves to a reply; `say(text, ok)` shows it. */
  constructor(box, ask, say) {
    this.box = box;
    this.ask = ask;
    this.say = say;
    this.wanted = new Map();
    this.asking = false;
    this.touched = new Map();
    this.fields = new Map();
    // What is being typed is not a value yet, and is left alone.
    box.addEventListener("input", ({ target }) => { if (target.type === "number") target.dataset.typing = "yes"; });
    for (const name of ["change", "focusout"]) box.addEventListener(name, ({ target }) => delete target.dataset.typing, { capture: true });
  }

  /** The full name of a parameter of the chosen axis. */
  full(name) { return this.axis ? `axis${this.axis}.${name}` : name; }

  build(device, axis) {
    this.device = device;
    this.axis = axis;
    this.fields.clear();
    this.wanted.clear();
    this.rates = [];
    for (let divisor = device.tick_rate_hz; divisor >= 1; --divisor) {
      const rate = device.tick_rate_hz / divisor;
      if (device.tick_rate_hz % divisor === 0 && rate >= 100) this.rates.push(rate);
    }
    this.box.replaceChildren(this.law(), ...SLIDERS.map((slider) => this.slider(slider)), this.ceilings());
    if (this.values) this.show(this.values, this.armed);
  }

  law() {
    const row = document.createElement("div");
    row.className = "row";
    const select = document.createElement("select");
    select.id = "law";
    select.setAttribute("aria-label", "Law of the wall");
    for (const name of this.device.parameters["wall.law"].values) select.add(new Option(LAWS[name] ?? name, name));
    select.onchange = () => this.want("wall.law", select.value);
    const here = Object.assign(document.createElement("button"), { type: "button", className: "plain", textContent: "Wall behind" });
    here.title = "Puts the surface 1 mm behind where the handle is: an axis cannot be armed inside the wall";
    here.onclick = () => this.want("wall.position", this.side > 0 ? "here-1mm" : "here+1mm");
    row.append(select, here);
    this.fields.set("wall.law", { locks: [select], show: (value) => { select.value = value; } });
    this.fields.set("wall.position", { locks: [here], show: () => {} });
    this.fields.set("wall.side", { locks: [], show: (value) => { this.side = Number(value); } });
    return row;
  }

  slider({ name, label, to, step }) {
    const { unit, help } = this.device.parameters[this.full(name)];
    const rates = name === "haptic.rate" ? this.rates : null;
    const row = document.createElement("div");
    row.className = "slider";
    row.title = help;
    const id = `field-${name.replaceAll(".", "-")}`;
    row.innerHTML = `<label for="${id}"></label><span class="value"><input type="number" id="${id}" min="0"><span class="unit"></span></span><input type="range" min="0">`;
    row.querySelector("label").textContent = label;
    row.querySelector(".unit").textContent = shownUnit(unit);
    const number = row.querySelector("[type=number]"), range = row.querySelector("[type=range]");
    range.setAttribute("aria-label", label);
    number.step = rates ? "any" : step;
    range.step = rates ? 1 : step;
    range.max = rates ? rates.length - 1 : to;
    const take = (shown) => {
      number.value = digits(shown, 5);
      this.want(name, fromShown(shown, unit));
    };
    range.oninput = () => take(rates ? rates[range.value] : Number(range.value));
    number.onchange = () => Number.isFinite(number.valueAsNumber) && take(number.valueAsNumber);
    this.fields.set(name, {
      locks: [range, number], row,
      show: (value) => {
        const shown = toShown(value, unit);
        number.value = digits(shown, 5);
        if (!rates && shown > Number(range.max)) range.max = shown;
        range.value = rates ? rates.findIndex((rate) => rate >= value) : shown;
      },
    });
    return row;
  }

  ceilings() {
    const details = document.createElement("details");
    details.innerHTML = "<summary>While armed, up to</summary>";
    details.title = "An armed axis only lets its bounds be tightened, or loosened up to these ceilings, which are set before";
    const row = document.createElement("div");
    row.className = "row";
    for (const { name, label } of CEILINGS) {
      const { unit } = this.device.parameters[this.full(name)];
      const one = document.createElement("label");
      one.className = "ceiling";
      const number = Object.assign(document.createElement("input"), { type: "number", min: 0, step: "any" });
      number.id = `field-${name.replaceAll(".", "-")}`;
      number.onchange = () => this.want(name, fromShown(number.valueAsNumber || 0, unit));
      one.append(`${label} `, number, ` ${shownUnit(unit)}`);
      row.append(one);
      this.fields.set(name, { locks: [number], show: (value) => { number.value = digits(toShown(value, unit), 5); } });
    }
    details.append(row);
    return details;
  }

  /** From the messages "parameters" and "state". */
  show(values, armed) {
    this.values = values;
    this.armed = armed;
    const now = performance.now();
    for (const [name, field] of this.fields) {
      const full = this.full(name);
      const locked = armed && this.device.parameters[full].change_while_armed === "none";
      for (const input of field.locks) input.disabled = locked;
      field.row?.classList.toggle("changed", values[full].value !== values[full].revert);
      if (field.locks.some((input) => input.dataset.typing) || this.wanted.has(name) || now - (this.touched.get(name) ?? -Infinity) < QUIET_MS) continue;
      field.show(values[full].value);
    }
  }

  want(name, value) {
    this.wanted.set(name, value);
    this.touched.set(name, performance.now());
    this.send();
  }

  async send() {
    if (this.asking || !this.wanted.size) return;
    this.asking = true;
    const values = Object.fromEntries([...this.wanted].map(([name, value]) => [this.full(name), value]));
    this.wanted.clear();
    const reply = await this.ask({ type: "set", axis: this.axis, values });
    this.asking = false;
    this.say(reply.message, reply.ok);
    if (!reply.ok) {
      for (const name of Object.keys(values)) this.touched.delete(name.replace(/^axis\d+\./, ""));
      this.show(this.values, this.armed);
    }
    this.send();
  }

  /** "kmax set ..." */
  command(address) {
    const part = (name) => {
      const { value, unit } = this.values[this.full(name)];
      return `${this.full(name)}=${typeof value === "string" ? value : `${digits(toShown(value, unit), 7)}${shownUnit(unit).replaceAll(" ", "")}`}`;
    };
    const names = ["wall.law", "wall.position", "wall.side", ...SLIDERS.map((slider) => slider.name)];
    return `kmax set --device '${address}' ${names.map(part).join(" ")}`;
  }
}
