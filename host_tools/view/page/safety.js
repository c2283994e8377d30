// STOP, and arming by press-and-hold.
//
// The space bar stops, wherever the focus is. Arming takes a press that lasts; if the focus is lost meanwhile, nobody knows
// what was meant: every axis is stopped. So it is when the page that armed is hidden: nobody could press STOP on it.

const HOLD_MS = 800;

export class Safety {
  /** `stream`; `axis()` the chosen one; `say(text, ok)`. */
  constructor(buttons, stream, axis, say) {
    this.arm = buttons.arm;
    this.words = buttons.words;
    this.progress = buttons.progress;
    this.stream = stream;
    this.axis = axis;
    this.say = say;
    this.armed = false;
    this.mine = false;
    buttons.stop.addEventListener("pointerdown", () => this.stop());
    buttons.stop.addEventListener("click", () => this.stop());
    addEventListener("keydown", (event) => this.keyDown(event), { capture: true });
    addEventListener("keyup", (event) => this.keyUp(event), { capture: true });
    this.arm.addEventListener("pointerdown", (event) => event.button === 0 && this.press());
    for (const name of ["pointerup", "pointerleave"]) this.arm.addEventListener(name, () => this.release());
    this.arm.addEventListener("pointercancel", () => this.lose());
    this.arm.addEventListener("contextmenu", (event) => event.preventDefault());
    this.arm.addEventListener("blur", () => this.lose());
    addEventListener("blur", () => this.lose());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden && (this.holding || this.mine)) this.stop();
    });
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
    } else if (event.key === "Enter" && event.target === this.arm) {
      event.preventDefault();
      if (!event.repeat) this.press();
    } else if (event.key === "Escape") {
      this.stop();
    }
  }

  keyUp(event) {
    if (event.code === "Space") event.preventDefault();
    if (event.key === "Enter" && event.target === this.arm) this.release();
  }

  press() {
    if (this.armed) {
      this.send("disarm");
      return;
    }
    if (this.holding) return;
    this.arm.classList.add("holding");
    this.holding = setTimeout(() => {
      this.release();
      this.send("arm");
    }, HOLD_MS);
  }

  release() {
    clearTimeout(this.holding);
    this.holding = null;
    this.arm.classList.remove("holding");
  }

  /** The focus went while the button was held. */
  lose() {
    if (this.holding) this.stop();
  }

  async send(type) {
    const reply = await this.stream.ask({ type, axis: this.axis() });
    this.say(reply.message, reply.ok);
  }

  /** `mine`: this page armed an axis. */
  show(armed, mine, connected) {
    this.armed = armed;
    this.mine = mine;
    this.words.textContent = armed ? "Disarm" : "Hold to arm";
    this.arm.classList.toggle("armed", armed);
    this.arm.disabled = !connected;
  }
}
