// The force over the distance from the surface: the law as it is drawn, where the handle has just been, the limit.

import { Plane, fitted } from "/drawing.js";
import { colour } from "/theme.js";
import { steady } from "/units.js";

const TRAIL_S = 1.5;
const FADES = 12;

/** A round number that is not below `value`: the picture does not breathe with every row. */
function roundedUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((m) => m * power).find((s) => s >= value * 0.9999);
}

export class LoopView {
  constructor(canvas, words) {
    this.canvas = canvas;
    this.words = words;
  }

  /** `curve`: message; `wall`: {position, side, limit} in SI units; `rows`: Rows. */
  draw(curve, wall, rows) {
    const drawn = fitted(this.canvas);
    if (!curve || !wall) return;
    const n = rows ? rows.within(TRAIL_S) : 0;
    const distance = new Float64Array(n), force = new Float64Array(n);
    for (let i = 0; i < n; ++i) {
      const place = rows.at(n - 1 - i);
      distance[i] = 1e3 * (rows.position[place] - wall.position) * wall.side;
      force[i] = rows.force[place] * wall.side;
    }
    const plane = this.plane(drawn, curve, wall, distance, force);
    plane.axes();
    plane.inside((context) => {
      this.shadeLimit(plane, context, wall.limit);
      this.surface(plane, context);
      this.law(plane, context, curve.distance_m, curve.force_n, []);
      if (curve.approaching_force_n) this.law(plane, context, curve.distance_m, curve.approaching_force_n, [6, 4]);
      this.trail(plane, context, distance, force);
    });
    this.words.textContent = n ? `${steady(distance[n - 1], 2)} mm  ${steady(force[n - 1], 2)} N` : "no rows yet";
  }

  plane(drawn, curve, wall, distance, force) {
    const lawInside = -1e3 * curve.distance_m[0], lawOutside = 1e3 * curve.distance_m.at(-1);
    const lawForce = Math.max(1, ...curve.force_n, ...(curve.approaching_force_n ?? []));
    let inside = lawInside, outside = lawOutside, up = Math.min(lawForce, wall.limit), down = 0.1;
    for (let i = 0; i < distance.length; ++i) {
      inside = Math.max(inside, -distance[i]);
      outside = Math.max(outside, distance[i]);
      up = Math.max(up, force[i]);
      down = Math.max(down, -force[i]);
    }
    // What is far away is of no use here: the handle is somewhere to the right then.
    outside = Math.min(outside, 2 * Math.max(lawOutside, 1));
    const limitVisible = wall.limit < 2 * up ? wall.limit * 1.12 : up;
    return new Plane(drawn,
      { from: -roundedUp(inside * 1.05), to: roundedUp(Math.max(outside, 0.5)), label: "distance outside the surface (mm), negative inside" },
      { from: -Math.max(0.3, roundedUp(down)), to: Math.max(up * 1.1, limitVisible), label: "force outwards (N)" });
  }

  shadeLimit(plane, context, limit) {
    context.fillStyle = colour("shade");
    const { left, end, top, bottom } = plane;
    for (const [from, to] of [[top, plane.y(limit)], [plane.y(-limit), bottom]]) {
      if (to <= from) continue;
      context.fillRect(left, from, end - left, to - from);
    }
    if (plane.y(limit) < top) return;
    context.strokeStyle = colour("limit");
    context.setLineDash([2, 3]);
    plane.line([[left, plane.y(limit)], [end, plane.y(limit)]]);
    context.setLineDash([]);
    context.fillStyle = colour("limit");
    context.textAlign = "right";
    context.fillText("force limit", end - 6, plane.y(limit) - 5);
  }

  surface(plane, context) {
    context.strokeStyle = colour("text-quiet");
    plane.line([[plane.x(0), plane.top], [plane.x(0), plane.bottom]]);
    context.fillStyle = colour("text-quiet");
    context.textAlign = "left";
    context.fillText("surface", plane.x(0) + 5, plane.bottom - 8);
  }

  law(plane, context, distance, force, dashes) {
    context.strokeStyle = colour("law");
    context.lineWidth = 2.5;
    context.setLineDash(dashes);
    plane.line(distance.map((d, i) => [plane.x(1e3 * d), plane.y(force[i])]));
    context.setLineDash([]);
  }

  trail(plane, context, distance, force) {
    const n = distance.length;
    if (!n) return;
    const right = plane.right.to;
    const at = (i) => [plane.x(Math.min(distance[i], right)), plane.y(force[i])];
    context.strokeStyle = colour("trail");
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    for (let fade = 0; fade < FADES; ++fade) {
      const from = Math.floor((n * fade) / FADES), to = Math.floor((n * (fade + 1)) / FADES);
      context.globalAlpha = 0.06 + 0.94 * ((fade + 1) / FADES) ** 2;
      context.beginPath();
      for (let i = Math.max(0, from - 1); i < to; ++i) context.lineTo(...at(i));
      context.stroke();
    }
    context.globalAlpha = 1;
    const [x, y] = at(n - 1);
    context.fillStyle = colour("trail");
    context.strokeStyle = colour("panel");
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, 6, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
}
