// A plane of two quantities on a canvas: scales, ticks, labels. For what a plot library has no picture of.

import { colour } from "/theme.js";
import { digits } from "/units.js";

/** Sized in device pixels, drawn in CSS pixels. */
export function fitted(canvas) {
  const box = canvas.parentElement.getBoundingClientRect();
  const ratio = devicePixelRatio;
  const width = Math.max(80, Math.floor(box.width)), height = Math.max(80, Math.floor(box.height));
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  return { context, width, height };
}

function linearTicks(from, to, wanted) {
  const raw = (to - from) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const ticks = [];
  for (let i = Math.ceil(from / step - 1e-9); i * step <= to + step * 1e-9; ++i) ticks.push(i * step);
  return ticks;
}

function logarithmicTicks(from, to) {
  const ticks = [];
  for (let power = Math.floor(Math.log10(from)); 10 ** power <= to * 1.0001; ++power) {
    for (const m of [1, 2, 5]) {
      const tick = m * 10 ** power;
      if (tick >= from * 0.9999 && tick <= to * 1.0001) ticks.push(tick);
    }
  }
  return ticks;
}

export class Plane {
  /** `right`, `up`: {from, to, logarithmic, label}. */
  constructor(drawn, right, up) {
    Object.assign(this, drawn, { right, up });
    this.left = 52;
    this.top = 10;
    this.bottom = this.height - 40;
    this.end = this.width - 12;
  }

  share(side, value) {
    if (side.logarithmic) return Math.log(value / side.from) / Math.log(side.to / side.from);
    return (value - side.from) / (side.to - side.from);
  }
  x(value) { return this.left + (this.end - this.left) * this.share(this.right, value); }
  y(value) { return this.bottom - (this.bottom - this.top) * this.share(this.up, value); }

  axes() {
    const { context } = this;
    context.lineWidth = 1;
    context.strokeStyle = colour("grid");
    context.fillStyle = colour("text-quiet");
    context.textAlign = "center";
    context.textBaseline = "top";
    const right = this.right.logarithmic ? logarithmicTicks(this.right.from, this.right.to)
      : linearTicks(this.right.from, this.right.to, Math.max(3, (this.end - this.left) / 80));
    for (const tick of right) {
      this.line([[this.x(tick), this.top], [this.x(tick), this.bottom]]);
      context.fillText(digits(tick, 4), this.x(tick), this.bottom + 5);
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    const up = this.up.logarithmic ? logarithmicTicks(this.up.from, this.up.to)
      : linearTicks(this.up.from, this.up.to, Math.max(3, (this.bottom - this.top) / 50));
    for (const tick of up) {
      this.line([[this.left, this.y(tick)], [this.end, this.y(tick)]]);
      context.fillText(digits(tick, 4), this.left - 6, this.y(tick));
    }
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    context.fillText(this.right.label, (this.left + this.end) / 2, this.height - 6);
    context.save();
    context.translate(12, (this.top + this.bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(this.up.label, 0, 0);
    context.restore();
  }

  line(points) {
    this.context.beginPath();
    points.forEach(([x, y], i) => (i ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
    this.context.stroke();
  }

  /** Draws only within the plane. */
  inside(draw) {
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(this.left, this.top, this.end - this.left, this.bottom - this.top);
    context.clip();
    draw(context);
    context.restore();
  }
}
