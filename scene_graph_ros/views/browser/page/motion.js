// Drags a robot by one of its links, and has the motion there planned, played and executed.

import { Gizmo, IDENTITY, rayAt } from "./gizmo.js";
import { Player } from "./player.js";
import { about, plus, minus, turnZTo, unit } from "./vectors.js";

const PAUSE = 70;  // ms between two drags that are told
const GHOST_COLOR = [0.35, 0.62, 1, 0.5], BAD_COLOR = [0.95, 0.12, 0.1, 0.75];
const NEAR = [0.9, 0, 0.1], FAR = [0, 0.75, 0.1];  // colours of what a motion keeps
const LINE = 0.004;  // half as thick as a motion's line is seen, part of its distance from the eye
const WATCHED = 0.6;  // of the time until a motion has to replace another one: for playing it
const STEP = 0.01, ANGLE = Math.PI / 36;  // m and rad, of one key
const KEYS = { ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 1, 0],
  ArrowRight: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };

const inMillimetres = (m) => `${(1000 * m).toPrecision(3)} mm`;
const inDegrees = (rad) => `${(180 * rad / Math.PI).toPrecision(3)}°`;

export class Motion {
  // `section` has the controls; onAsk is told requests, onChange that there is something else to draw.
  constructor(section, { canvas, renderer, onAsk, onChange }) {
    Object.assign(this, { section, canvas, renderer, onAsk, onChange });
    this.gizmo = new Gizmo();
    this.held = null;  // the newest answer of the node
    this.plan = null;
    this.number = 0;
    this.wanted = null;  // a pose that is not told yet
    this.timer = null;
    this.told = "";
    this.player = new Player(() => this.showTime(), () => this.showPlan());
    const find = (name) => section.querySelector(`[name="${name}"]`);
    this.parts = Object.fromEntries(["link", "group", "speed", "plan", "cancel", "play", "time",
      "execute", "replace"].map((name) => [name, find(name)]));
    const { link, group, speed, plan, cancel, play, time, execute, replace } = this.parts;
    link.addEventListener("change", () => this.hold());
    group.addEventListener("change", () => this.hold(group.value));
    const ask = (replaces) => this.onAsk({ motion: "plan", scaling: Number(speed.value), replaces });
    plan.addEventListener("click", () => ask(false));
    replace.addEventListener("click", () => ask(true));
    cancel.addEventListener("click", () => {
      if (this.plan?.within) this.takePlan({ plan: 0 });
      this.onAsk({ motion: "cancel" });
    });
    play.addEventListener("click", () => this.play());
    time.addEventListener("input", () => this.player.go(Number(time.value)));
    execute.addEventListener("click", () => this.execute());
  }

  // Offers the links of robots {robot, links, executes}, where they are other ones than before.
  list(robots) {
    const told = JSON.stringify(robots);
    if (told === this.told) return;
    this.told = told;
    this.executes = robots.some((each) => each.executes);
    this.parts.link.replaceChildren(new Option("nothing", ""), ...robots.map(({ robot, links }) => {
      const group = Object.assign(document.createElement("optgroup"), { label: robot });
      group.append(...links.map((link) => new Option(link, JSON.stringify([robot, link]))));
      return group;
    }));
    this.parts.execute.hidden = this.parts.replace.hidden = !this.executes;
    this.section.hidden = !robots.length;
    this.take({ held: null });
  }

  // Holds the link that is chosen.
  hold(group = "") {
    const chosen = this.parts.link.value;
    if (!chosen) {
      this.onAsk({ motion: "let_go" });
      return;
    }
    const [robot, link] = JSON.parse(chosen);
    this.number = 0;
    this.onAsk({ motion: "hold", robot, link, group });
  }

  // Holds the link that an item belongs to; tells whether there is one.
  holdItem({ path: [, source, frame] }) {
    const value = JSON.stringify([source, frame.replace(`${source}/`, "")]);
    if (![...this.parts.link.options].some((option) => option.value === value)) return false;
    this.parts.link.value = value;
    this.hold();
    return true;
  }

  // Holds nothing, as another server knows of nothing.
  forget() {
    this.takePlan({ plan: 0 });
    this.take({ held: null });
  }

  // Takes the node's answer.
  take(held) {
    this.held = held.held ? held : null;
    this.late = held.late;
    this.reason = held.reason ?? "";
    this.planning = held.planning ?? "";
    this.executing = held.executing ?? false;
    if (!this.held) {
      this.gizmo.position = this.gizmo.grabbed = null;
      if (!this.late && !this.reason) this.parts.link.value = "";
    } else if (!this.gizmo.grabbed && this.wanted === null && held.number >= this.number) {
      this.gizmo.position = held.position;
      this.gizmo.rotation = held.rotation;
    }
    this.say();
  }

  execute() {
    this.onAsk({ motion: "execute", plan: this.plan.plan });
  }

  // Takes a motion, and plays it once; number 0 is none. One that replaces another is played as fast
  // as it has to be, and then executed, unless that is cancelled before.
  takePlan(plan) {
    this.plan = plan.plan ? plan : null;
    this.wasPlayed = false;
    this.player.clear();
    if (this.plan) {
      this.player.load(this.plan);
      this.parts.time.max = this.plan.duration;
      const { duration, within } = this.plan;
      this.player.play(within ? Math.max(1, duration / (WATCHED * within)) : 1);
    }
    this.say();
  }

  play() {
    this.player.play();
  }

  showTime() {
    this.parts.time.value = this.player.time;
    this.onChange();
  }

  showPlan() {
    const isFirst = !this.wasPlayed;
    this.wasPlayed = true;
    if (isFirst && this.plan.within) this.execute();
    this.say();
  }

  // Says how it is.
  say() {
    const { held, plan, parts, section } = this, isFree = held && !held.collisions.length;
    section.querySelector(".held").hidden = !held;
    if (held) {
      const groups = [...new Set([held.group, ...held.groups])];
      parts.group.replaceChildren(...groups.map((name) => new Option(name || "all joints", name)));
      parts.group.value = held.group;
    }
    const isSearching = Boolean(this.planning);
    parts.plan.disabled = !held?.has_moved || !isFree || isSearching;
    parts.replace.disabled = parts.plan.disabled || !this.executing;
    parts.cancel.hidden = !isSearching && !(plan?.within && !this.wasPlayed);
    parts.execute.disabled = !plan || !this.wasPlayed || this.executing;
    section.querySelector(".plan").hidden = !plan;
    this.write(".reach", this.reach());
    this.write(".bad", [this.late, this.reason].filter(Boolean).join("; "));
    this.write(".busy", isSearching ? this.planning : this.executing ? "executing" : "");
    if (plan) {
      this.write(".keeps", `${plan.duration.toFixed(2)} s; everything keeps `
        + `${inMillimetres(plan.least_clearance)}, the way at least `
        + `${inMillimetres(Math.min(...plan.proven))} from what is around`);
    }
    section.dataset.state = JSON.stringify({ number: held?.number ?? -1, plan: plan?.plan ?? 0,
      isPlayed: Boolean(plan && this.wasPlayed), executing: this.executing });
    this.onChange();
  }

  write(selector, words) {
    const element = this.section.querySelector(selector);
    element.textContent = words;
    element.hidden = !words;
  }

  reach() {
    const { held } = this;
    if (!held) return "";
    if (held.collisions.length) {
      const [[one, other, depth]] = held.collisions;
      const more = held.collisions.length - 1;
      return `${one} and ${other} overlap by ${inMillimetres(depth)}${more ? `, and ${more} more` : ""}`;
    }
    if (!held.has_moved) return "drag a handle, or use arrow keys and page up and down";
    if (held.is_reached) return "reached, and free";
    return `free, and ${inMillimetres(held.position_error)}, ${inDegrees(held.rotation_error)} off`;
  }

  // Drags by a press on a handle; null where there is none.
  grab(event, camera) {
    if (!this.held) return null;
    const { eye } = camera.view(1), ratio = this.canvas.width / this.canvas.clientWidth;
    const bodies = this.gizmo.bodies(eye, event.pointerType === "touch");
    const found = this.renderer.bodyAt(camera, bodies, ratio * event.offsetX, ratio * event.offsetY);
    if (found < 0) {
      this.onChange();
      return null;
    }
    const pose = this.gizmo.grab(bodies[found].handle, camera, rayAt(camera, this.canvas, event));
    this.onChange();
    return {
      drag: (now) => this.move(pose(rayAt(camera, this.canvas, now))),
      end: () => {
        this.gizmo.grabbed = null;
        this.onChange();
      },
    };
  }

  // Moves by a key, with shift turns; tells whether it is one for that.
  press(event) {
    const axis = KEYS[event.key], { position, rotation } = this.gizmo;
    if (!this.held || !position || !axis) return false;
    this.move(event.shiftKey ? { position, rotation: about(axis, ANGLE, rotation) }
      : { position: plus(position, axis, STEP), rotation });
    return true;
  }

  // Wants the link to be at a pose; of those that come too fast the newest is told.
  move(pose) {
    Object.assign(this.gizmo, pose);
    this.wanted = pose;
    if (this.timer === null) this.send();
    this.onChange();
  }

  send() {
    this.timer = this.wanted ? setTimeout(() => this.send(), PAUSE) : null;
    if (!this.wanted) return;
    const { position, rotation } = this.wanted;
    this.wanted = null;
    this.number += 1;
    this.onAsk({ motion: "drag", number: this.number, position, rotation });
  }

  // Adds the robot as it is dragged or played, and a motion's line, to a picture; what would collide
  // is red.
  dress(picture, eye) {
    const { held, plan } = this;
    if (!held) return picture;
    const bad = new Set(held.colliding), poses = plan ? this.player.poses() : this.ghosts();
    const bodies = [], plain = [];
    for (const body of picture.bodies) {
      const pose = poses.get(body.geometry);
      const isBad = !plan && bad.has(body.geometry);
      if (pose || !isBad) bodies.push(body);
      else plain.push({ ...body, sheer: false, color: [...BAD_COLOR.slice(0, 3), 1] });
      if (pose) plain.push({ ...body, ...pose, color: isBad ? BAD_COLOR : GHOST_COLOR });
    }
    return { ...picture, bodies, plain,
      marks: [...picture.marks, ...this.line(eye), ...this.gizmo.bodies(eye)] };
  }

  ghosts() {
    const { geometries, positions, rotations, has_moved: hasMoved, collisions } = this.held;
    const result = new Map();
    if (!hasMoved && !collisions.length) return result;
    geometries.forEach((geometry, k) => result.set(geometry, {
      position: positions.slice(3 * k, 3 * k + 3), rotation: rotations.slice(4 * k, 4 * k + 4) }));
    return result;
  }

  line(eye) {
    if (!this.plan) return [];
    const { way, proven, far } = this.plan;
    return proven.map((clearance, k) => {
      const between = minus(way[k + 1], way[k]), length = Math.hypot(...between);
      const middle = plus(way[k], between, 0.5), thick = LINE * Math.hypot(...minus(middle, eye));
      const part = Math.min(clearance / far, 1);
      const color = NEAR.map((value, j) => value + part * (FAR[j] - value));
      return { batch: "capsule", position: middle, color: [...color, 1],
        rotation: length ? turnZTo(unit(between)) : IDENTITY,
        stretch: [thick, thick, thick, length / 2] };
    });
  }
}
