// STOP, and buttons that have to be held: what arms an axis takes a press that lasts.
//
// The space bar stops, wherever the focus is. If the focus is lost while a button is held, nobody knows what was meant: every
// axis is stopped. So it is when the page that armed is hidden: nobody could press STOP on it.

const HOLD_MS = 800;

export class Safety {
  /** `stream`; `axis()` the chosen one; `say(text, ok)`. */
  constructor(buttons, stream, axis, say) {
    this.arm = buttons.arm;
    this.words = buttons.words;
    this.stream = stream;
    this.axis = axis;
    this.say = say;
    this.armed = false;
    this.mine = false;
    this.held = new Map();
    buttons.stop.addEventListener("pointerdown", () => this.stop());
    buttons.stop.addEventListener("click", () => this.stop());
    addEventListener("keydown", (event) => this.keyDown(event), { capture: true });
    addEventListener("keyup", (event) => this.keyUp(event), { capture: true });
    addEventListener("blur", () => this.lose());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden && (this.holding || this.mine)) this.stop();
    });
    this.hold(this.arm, () => this.send("arm"));
  }

  /** `done()` once `button` has been held, by a pointer or by the Enter key. */
  hold(button, done) {
    this.held.set(button, done);
    button.classList.add("hold");
    button.append(document.createElement("i"));
    button.addEventListener("pointerdown", (event) => event.button === 0 && this.press(button));
    for (const name of ["pointerup", "pointerleave"]) button.addEventListener(name, () => this.release());
    for (const name of ["pointercancel", "blur"]) button.addEventListener(name, () => this.lose());
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  async stop() {
    this.release();
    const reply = await this.stream.ask({ type: "stop" });
    this.say(reply.ok ? "" : `STOP: ${reply.message}`, reply.ok);
  }

  keyDown(event) {
    if (event.code === "Space") {
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.stop();
    } else if (event.key === "Enter" && this.held.has(event.target)) {
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.press(event.target);
    } else if (event.key === "Escape") {
      this.stop();
    }
  }

  keyUp(event) {
    if (event.code === "Space") event.preventDefault();
    if (event.key === "Enter" && this.held.has(event.target)) this.release();
  }

  press(button) {
    if (button === this.arm && this.armed) {
      this.send("disarm");
      return;
    }
    if (this.holding || button.disabled) return;
    button.classList.add("holding");
    const timer = setTimeout(() => {
      this.release();
      this.held.get(button)();
    }, HOLD_MS);
    this.holding = { button, timer };
  }

  release() {
    if (!this.holding) return;
    clearTimeout(this.holding.timer);
    this.holding.button.classList.remove("holding");
    this.holding = null;
  }

  /** The focus went while a button was held. */
  lose() {
    if (this.holding) this.stop();
  }

  async send(type) {
    const reply = await this.stream.ask({ type, axis: this.axis() });
    this.say(reply.message, reply.ok);
  }

  /** `mine`: this page armed an axis, or started a procedure that does; `usable`: the axis can be armed from here. */
  show(armed, mine, usable) {
    this.armed = armed;
    this.mine = mine;
    this.words.textContent = armed ? "Disarm" : "Hold to arm";
    this.arm.classList.toggle("armed", armed);
    this.arm.disabled = !usable;
  }
}
