// A camera that goes around what it looks at; z is up.

import { cross, plus, projection, unit } from "./vectors.js";

const FIELD_OF_VIEW = 0.8;  // rad, from bottom to top
const HIGHEST = 1.55;  // rad, just below straight down
const NEAREST = 1e-6;  // m
const CLICK = 4;  // pixels: a press that moves no farther is no drag

const apart = (one, two) => Math.hypot(one.clientX - two.clientX, one.clientY - two.clientY);

export class Camera {
  // onClick gets the event of a press that was no drag. onGrab gets that of a press, and returns
  // {drag, end} where something is dragged by it, not the camera; else null.
  constructor(canvas, onChange, onClick, onGrab = () => null) {
    this.target = [0, 0, 0];
    this.distance = 3;
    this.azimuth = -0.9;
    this.elevation = 0.45;
    this.onChange = onChange;
    this.pointers = new Map();
    this.grabbed = null;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus();
      if (event.button === 0 && !event.shiftKey && !this.pointers.size && !this.grabbed) {
        const grabbed = onGrab(event);
        if (grabbed) {
          this.grabbed = { id: event.pointerId, ...grabbed };
          return;
        }
      }
      this.pointers.set(event.pointerId, event);
      this.pressed = event.button === 0 && this.pointers.size === 1 ? event : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      if (this.pressed && apart(this.pressed, event) < CLICK) onClick(event);
      this.pressed = null;
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => {
        this.pointers.delete(event.pointerId);
        if (this.grabbed?.id !== event.pointerId) return;
        this.grabbed.end();
        this.grabbed = null;
      });
    }
    canvas.addEventListener("pointermove", (event) => this.drag(event, canvas.clientHeight));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
    }, { passive: false });
  }

  drag(event, height) {
    if (this.grabbed?.id === event.pointerId) this.grabbed.drag(event);
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers.values()].filter((p) => p.pointerId !== event.pointerId);
      this.zoom((apart(before, other) || 1) / (apart(event, other) || 1));
      this.move(dx / 2, dy / 2, height);
    } else if (event.buttons & 2 || event.buttons & 4 || event.shiftKey) {
      this.move(dx, dy, height);
    } else if (!this.pressed || apart(this.pressed, event) >= CLICK) {
      this.pressed = null;
      this.azimuth -= 0.007 * dx;
      this.elevation = Math.max(-HIGHEST, Math.min(HIGHEST, this.elevation + 0.007 * dy));
    }
    this.pointers.set(event.pointerId, event);
    this.onChange();
  }

  move(dx, dy, height) {
    const scale = 2 * this.distance * Math.tan(FIELD_OF_VIEW / 2) / height;
    const { right, up } = this.axes();
    this.target = plus(plus(this.target, right, -dx * scale), up, dy * scale);
    this.onChange();
  }

  zoom(factor) {
    this.distance = Math.max(NEAREST, this.distance * factor);
    this.onChange();
  }

  // Sees a ball nearly as a whole: what is in it hardly ever fills it.
  fit(center, radius) {
    this.target = center;
    this.distance = Math.max(NEAREST, 0.75 * radius / Math.sin(FIELD_OF_VIEW / 2));
    this.onChange();
  }

  axes() {
    const flat = Math.cos(this.elevation);
    const back = [flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth),
      Math.sin(this.elevation)];
    const right = unit(cross([0, 0, 1], back));
    return { right, up: cross(back, right), back };
  }

  // Returns where the eye is, the matrix that draws what is given relative to it, and how tall is
  // what fills the height at a distance, as part of that.
  view(aspect) {
    const { right, up, back } = this.axes();
    const focal = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const near = 0.01 * this.distance, far = 2000 * this.distance;
    return {
      eye: plus(this.target, back, this.distance), right, up, back, far, tallness: 2 / focal,
      matrix: projection(right, up, back, focal, aspect, near, far),
    };
  }
}
