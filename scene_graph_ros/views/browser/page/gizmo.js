// Handles at a pose that is dragged: a ball moves it in the plane of the screen, arrows along its own
// axes, rings turn it about them.

import { about, cross, dot, minus, plus, times, turn, turnZTo, unit } from "./vectors.js";

const SIZE = 0.09;  // of an arrow, as seen: part of its distance from the eye
const COLORS = [[0.95, 0.3, 0.3, 1], [0.3, 0.85, 0.35, 1], [0.35, 0.55, 1, 1]];  // of x, y and z
const BALL_COLOR = [0.95, 0.95, 0.95, 1], GRABBED_COLOR = [1, 0.85, 0.2, 1];
const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const FINGER = 2.2;  // how much thicker handles are for a finger
const EDGE_ON = 0.2;  // the sine of the angle to a ring's plane below which it is seen from its edge

export const IDENTITY = [0, 0, 0, 1];

// Returns a ray {from, along} through a place of the canvas (in its CSS pixels, from above).
export function rayAt(camera, canvas, event) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const { eye, right, up, back, tallness } = camera.view(width / Math.max(height, 1));
  const x = (event.offsetX - width / 2) * tallness / height;
  const y = (height / 2 - event.offsetY) * tallness / height;
  return { from: eye, along: plus(plus(times(right, x), up, y), back, -1) };
}

// Returns where a ray meets the plane through a point with a normal, null where it never does.
function onPlane({ from, along }, point, normal) {
  const slope = dot(along, normal);
  if (Math.abs(slope) < 1e-9) return null;
  const distance = dot(minus(point, from), normal) / slope;
  return distance > 0 ? plus(from, along, distance) : null;
}

// Returns how far along the line through a point, by a unit axis, it is nearest to a ray.
function alongLine({ from, along }, point, axis) {
  const ray = unit(along), b = dot(axis, ray), away = minus(point, from);
  const square = 1 - b * b;
  return square < 1e-6 ? null : (b * dot(ray, away) - dot(axis, away)) / square;
}

export class Gizmo {
  constructor() {
    this.position = null;
    this.rotation = IDENTITY;
    this.grabbed = null;  // the name of a handle
  }

  size(eye) { return SIZE * Math.hypot(...minus(this.position, eye)); }

  // Returns the handles as bodies, each with its name; thicker ones to be met by a finger.
  bodies(eye, isForFinger = false) {
    if (!this.position) return [];
    const size = this.size(eye), thick = size * (isForFinger ? FINGER : 1);
    const result = [];
    const add = (handle, color, body) => result.push({ handle,
      color: this.grabbed === handle ? GRABBED_COLOR : color, ...body });
    AXES.forEach((unturned, k) => {
      const axis = turn(this.rotation, unturned), rotation = turnZTo(axis);
      add(`ring ${k}`, COLORS[k], { batch: isForFinger ? "wide ring" : "ring",
        position: this.position, rotation, stretch: [size, size, size, 0] });
    });
    AXES.forEach((unturned, k) => {
      const axis = turn(this.rotation, unturned), rotation = turnZTo(axis);
      add(`arrow ${k}`, COLORS[k], { batch: "cylinder", rotation,
        position: plus(this.position, axis, 0.75 * size),
        stretch: [0.02 * thick, 0.02 * thick, 0.75 * size, 0] });
      add(`arrow ${k}`, COLORS[k], { batch: "ellipsoid", rotation,
        position: plus(this.position, axis, 1.5 * size),
        stretch: [0.07 * thick, 0.07 * thick, 0.13 * size, 0] });
    });
    add("ball", BALL_COLOR, { batch: "ellipsoid", position: this.position, rotation: IDENTITY,
      stretch: [0.12 * thick, 0.12 * thick, 0.12 * thick, 0] });
    return result;
  }

  // Begins to drag a handle; returns a function from a ray to the pose {position, rotation} then.
  grab(handle, camera, ray) {
    this.grabbed = handle;
    const { position, rotation } = this, { back } = camera.axes();
    const [kind, number] = handle.split(" ");
    const axis = turn(rotation, AXES[number ?? 2]);
    if (kind === "ball") {
      const first = onPlane(ray, position, back) ?? position;
      return (now) => {
        const hit = onPlane(now, position, back) ?? first;
        return { position: plus(position, minus(hit, first)), rotation };
      };
    }
    if (kind === "arrow") {
      const first = alongLine(ray, position, axis) ?? 0;
      return (now) => {
        const way = (alongLine(now, position, axis) ?? first) - first;
        return { position: plus(position, axis, way), rotation };
      };
    }
    const angle = this.angling(axis, back, ray);
    return (now) => ({ position, rotation: about(axis, angle(now), rotation) });
  }

  // Returns the angle about an axis, by rays: in its plane or, seen from the edge, across it.
  angling(axis, back, ray) {
    const { position } = this;
    if (Math.abs(dot(axis, back)) > EDGE_ON) {
      const from = (now) => minus(onPlane(now, position, axis) ?? position, position);
      const first = from(ray);
      return (now) => {
        const last = from(now);
        return Math.atan2(dot(axis, cross(first, last)), dot(first, last));
      };
    }
    const across = unit(cross(axis, back)), size = this.size(ray.from);
    const at = (now) => dot(minus(onPlane(now, position, back) ?? position, position), across);
    const first = at(ray);
    return (now) => (at(now) - first) / size;
  }
}
