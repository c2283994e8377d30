// The stream of docs/view.md: one WebSocket, opened again when it is lost; requests that are answered.

const PROTOCOL = "kmax.v1";
const RETRY_MS = 700;
const ALIVE_MS = 500;

export class Stream {
  /** `token` of the address the page was opened with; `heard(message)` gets every message, `changed(connected)` the rest. */
  constructor(token, heard, changed) {
    this.token = token;
    this.heard = heard;
    this.changed = changed;
    this.waiting = new Map();
    this.lastId = 0;
    this.open();
    setInterval(() => this.tell({ type: "alive" }), ALIVE_MS);
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/stream`, [PROTOCOL, `token.${this.token}`]);
    this.socket.onopen = () => this.changed(true);
    this.socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    this.socket.onclose = () => {
      for (const answer of this.waiting.values()) answer({ ok: false, message: "kmax view has gone" });
      this.waiting.clear();
      this.changed(false);
      setTimeout(() => this.open(), RETRY_MS);
    };
  }

  receive(message) {
    if (message.type === "reply") {
      const answer = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (answer) answer(message);
      return;
    }
    this.heard(message);
  }

  /** Without waiting for an answer. False: nobody is there. */
  tell(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Resolves to the reply: {ok, message}. */
  ask(message) {
    const id = ++this.lastId;
    return new Promise((resolve) => {
      this.waiting.set(id, resolve);
      if (this.tell({ ...message, id })) return;
      this.waiting.delete(id);
      resolve({ ok: false, message: "kmax view cannot be reached" });
    });
  }
}
