// The stability map: where each criterion's bound runs, and the present parameters as a cross that leaves a track.

import { Plane, fitted } from "/drawing.js";
import { colour } from "/theme.js";
import { shownUnit, toShown } from "/units.js";

// Okabe and Ito's colours, then dashes: lines differ in both.
const STYLES = [
  ["line-1", []], ["line-2", []], ["line-3", []], ["line-4", []], ["line-5", []], ["line-6", []],
  ["line-1", [6, 3]], ["line-2", [6, 3]], ["line-3", [6, 3]], ["line-4", [6, 3]],
];
const TRACK = 40;

export function styleOf(place) {
  const [name, dashes] = STYLES[place % STYLES.length];
  return { colour: colour(name), dashes };
}

export class MapView {
  constructor(canvas) {
    this.canvas = canvas;
    this.track = [];
  }

  /** `map`: message; `present(name)`: a parameter's value. */
  draw(map, present) {
    const drawn = fitted(this.canvas);
    if (!map) return;
    const side = (one) => ({
      from: toShown(one.from, one.unit), to: toShown(one.to, one.unit), logarithmic: one.logarithmic,
      label: `${one.name} (${shownUnit(one.unit)})`,
    });
    const plane = new Plane(drawn, side(map.right), side(map.up));
    const points = ([xs, ys]) =>
      xs.map((x, i) => [plane.x(toShown(x, map.right.unit)), plane.y(toShown(ys[i], map.up.unit))]);
    plane.inside((context) => {
      for (const [outlines, name] of [[map.all_met, "met"], [map.unstable, "unstable"]]) {
        context.fillStyle = colour(name);
        context.beginPath();
        for (const outline of outlines) points(outline).forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
        context.fill();
      }
    });
    plane.axes();
    plane.inside((context) => {
      map.bounds.forEach((bound, i) => {
        const style = styleOf(i);
        context.strokeStyle = style.colour;
        context.lineWidth = 2;
        context.setLineDash(style.dashes);
        for (const stroke of bound.strokes) plane.line(points(stroke));
        context.setLineDash([]);
      });
      this.cross(plane, context, map, present);
    });
  }

  cross(plane, context, map, present) {
    const clamped = (side, value) => Math.min(side.to, Math.max(side.from, value));
    const x = clamped(map.right, present(map.right.name)), y = clamped(map.up, present(map.up.name));
    const key = `${map.axis} ${map.up.name}`;
    if (this.key !== key) this.track = [];
    this.key = key;
    const last = this.track.at(-1);
    if (!last || last[0] !== x || last[1] !== y) this.track.push([x, y]);
    if (this.track.length > TRACK) this.track.shift();
    const at = ([a, b]) => [plane.x(toShown(a, map.right.unit)), plane.y(toShown(b, map.up.unit))];
    context.strokeStyle = colour("trail");
    context.lineWidth = 1.5;
    for (let i = 1; i < this.track.length; ++i) {
      context.globalAlpha = i / this.track.length;
      plane.line([at(this.track[i - 1]), at(this.track[i])]);
    }
    context.globalAlpha = 1;
    const [px, py] = at([x, y]);
    for (const [width, name] of [[6, "panel"], [3, "text"]]) {
      context.lineWidth = width;
      context.strokeStyle = colour(name);
      plane.line([[px - 9, py], [px + 9, py]]);
      plane.line([[px, py - 9], [px, py + 9]]);
    }
  }
}
