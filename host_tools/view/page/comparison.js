// Recordings over each other: force over the distance from the surface, and over time. Nothing of them leaves the browser.

import { Plane, fitted } from "/drawing.js";
import { element, swatch } from "/elements.js";
import { styleOf } from "/map_view.js";
import { distances, parseRecording, touchTime } from "/recording_file.js";
import { digits } from "/units.js";

const MOST_BYTES = 200e6;

function range(lists, least) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) {
    for (const value of list) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  const room = Math.max(0.04 * (high - low), least / 2);
  return { from: low - room, to: high + room };
}

export class Comparison {
  /** `axis()` the chosen one; `wall()`: {position, side} of the device, for recordings that do not say theirs. */
  constructor(boxes, axis, wall) {
    Object.assign(this, { boxes, axis, wall });
    this.recordings = [];
    boxes.files.onchange = async () => {
      await this.load([...boxes.files.files]);
      boxes.files.value = "";
    };
    boxes.area.addEventListener("dragover", (event) => event.preventDefault());
    boxes.area.addEventListener("drop", (event) => {
      event.preventDefault();
      this.load([...event.dataTransfer.files]);
    });
    boxes.align.onchange = () => this.draw();
    new ResizeObserver(() => this.draw()).observe(boxes.area);
  }

  async load(files) {
    const troubles = [];
    for (const file of files) {
      try {
        if (file.size > MOST_BYTES) throw new Error(`${file.name}: ${Math.round(file.size / 1e6)} MB are too much for a browser; at most ${MOST_BYTES / 1e6} MB`);
        this.add(file.name, await file.text());
      } catch (error) {
        troubles.push(error.message);
      }
    }
    this.say(troubles.join("\n"));
  }

  /** Errors of parseRecording(). */
  add(name, text) {
    this.recordings.push({ ...parseRecording(name, text, this.axis()), style: this.freeStyle() });
    this.say("");
    this.draw();
  }

  say(trouble) { this.boxes.said.textContent = trouble; }

  freeStyle() {
    let place = 0;
    while (this.recordings.some(({ style }) => style === place)) ++place;
    return place;
  }

  draw() {
    const lines = this.recordings.map((one) => {
      const wall = one.wall ?? this.wall();
      const distance = distances(one, wall);
      const from = this.boxes.align.checked ? touchTime(one, distance) : 0;
      return {
        ...one, force: one.force.map((value) => value * wall.side), distance: distance.map((d) => 1e3 * d), time: one.time.map((t) => t - from),
      };
    });
    this.legend(lines);
    this.plot(this.boxes.overDistance, lines, "distance", "distance outside the surface (mm), negative inside", 0.2);
    this.plot(this.boxes.overTime, lines, "time", this.boxes.align.checked ? "time since the first touch (s)" : "time (s)", 1e-3);
  }

  plot(canvas, lines, across, label, least) {
    const drawn = fitted(canvas);
    if (!lines.length) return;
    const plane = new Plane(drawn, { ...range(lines.map((line) => line[across]), least), label },
      { ...range(lines.map((line) => line.force), 0.2), label: "force outwards (N)" });
    plane.axes();
    plane.inside((context) => {
      context.lineWidth = 1.6;
      context.lineJoin = "round";
      context.globalAlpha = 0.75;  // one that oscillates covers the others
      for (const line of lines) {
        const { colour, dashes } = styleOf(line.style);
        context.strokeStyle = colour;
        context.setLineDash(dashes);
        plane.line(line[across].map((value, i) => [plane.x(value), plane.y(line.force[i])]));
      }
      context.setLineDash([]);
      context.globalAlpha = 1;
    });
  }

  legend(lines) {
    this.boxes.legend.replaceChildren(...lines.map((line, i) => {
      const remove = element("button", { type: "button", className: "plain small" }, "remove");
      remove.setAttribute("aria-label", `Remove ${line.name}`);
      remove.onclick = () => {
        this.recordings.splice(i, 1);
        this.draw();
      };
      const [low, high] = line.force.reduce(([a, b], one) => [Math.min(a, one), Math.max(b, one)], [Infinity, -Infinity]);
      const facts = line.facts.filter((fact) => /^(date|program|device|data):/.test(fact)).join("\n");
      return element("li", { title: facts }, swatch(styleOf(line.style)), element("b", {}, line.name),
        element("span", { className: "quiet" }, `${line.time.length} rows, ${digits(line.time.at(-1) - line.time[0])} s, ${digits(low)} to ${digits(high)} N${line.wall ? "" : "; it does not say where its wall is: drawn with the device's"}`), remove);
    }));
    this.boxes.empty.hidden = Boolean(lines.length);
  }
}
