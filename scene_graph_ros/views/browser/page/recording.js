// What ../page_file.py wrote into the page, shown along a time line; in place of a connection.

import { readBlocks } from "./blocks.js";

const TOUCHING = ["contacts", "surfaces"];

export class Recording {
  // Reads `element`; `bar` has the controls. The rest is as for a connection.
  constructor(element, bar, onBlocks, onState) {
    const { data, ...content } = JSON.parse(element.textContent);
    Object.assign(this, content);
    element.remove();
    this.onBlocks = onBlocks;
    this.onState = onState;
    this.wish = { roles: null, contacts: true };
    this.shown = -1;  // which moment
    this.isPlaying = false;
    this.button = bar.querySelector("button");
    this.slider = bar.querySelector("input");
    this.pace = bar.querySelector("select");
    this.label = bar.querySelector("output");
    this.end = this.times.at(-1);
    this.slider.max = this.end;
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.play(!this.isPlaying));
    window.addEventListener("keydown", (event) => this.press(event));
    bar.hidden = this.times.length < 2;  // a still has no time line
    this.onState(true, "unpacking");
    this.unpack(data).then(() => {
      this.onState(true, "recording");
      this.go(0);
    }, (error) => this.onState(false, `damaged: ${error.message}`));
  }

  press(event) {
    if (["INPUT", "BUTTON", "SELECT"].includes(event.target.tagName)) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key !== " " && !step) return;
    event.preventDefault();
    this.play(step ? false : !this.isPlaying);
    if (step) this.go(this.times[this.shown + step] ?? this.time);
  }

  async unpack(data) {
    const packed = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    this.buffer = await new Response(stream).arrayBuffer();
  }

  // Shows how it was at a time in s.
  go(time) {
    this.time = Math.max(0, Math.min(this.end, time));
    this.slider.value = this.time;
    this.label.textContent = `${this.time.toFixed(2)} of ${this.end.toFixed(2)} s`;
    const index = Math.max(0, firstAfter(this.times, this.time) - 1);
    if (this.buffer && index !== this.shown) this.show(index);
  }

  show(index) {
    const begin = Math.max(...Object.keys(this.wholes).map(Number).filter((k) => k <= index));
    const isOnward = this.shown >= begin && this.shown < index;
    const messages = isOnward ? [] : [this.wholes[begin]];
    for (let k = (isOnward ? this.shown : begin) + 1; k <= index; k++) messages.push(this.changes[k]);
    this.shown = index;
    messages.forEach((numbers, k) => this.tell(numbers, k === messages.length - 1));
  }

  // Hands on what is wished for of a message; what touches only of one that no other follows.
  tell(numbers, isLast) {
    const { begins, buffer } = this;
    const blocks = numbers.flatMap((n) => readBlocks(buffer, begins[n], begins[n + 1]));
    const isSeen = isLast && this.wish.contacts;
    this.onBlocks(blocks.filter((block) => isSeen || !TOUCHING.includes(block.kind)).map(
      (block) => (block.kind === "scene" ? this.wished(block) : block)));
  }

  // Returns what there is of the roles that are shown: at first, of the first that there is.
  wished(scene) {
    const roles = this.wish.roles ?? scene.roles.filter((role) => scene.counts[role]).slice(0, 1);
    return { ...scene, roles, appeared: scene.appeared.filter(({ path }) => roles.includes(path[0])) };
  }

  play(isPlaying) {
    this.isPlaying = isPlaying;
    cancelAnimationFrame(this.frame);
    this.button.textContent = isPlaying ? "Pause" : "Play";
    if (!isPlaying) return;
    if (this.time >= this.end) this.go(0);
    let before = performance.now();
    const step = (now) => {
      this.go(this.time + Number(this.pace.value) * (now - before) / 1000);
      before = now;
      if (this.time < this.end) this.frame = requestAnimationFrame(step);
      else this.play(false);
    };
    this.frame = requestAnimationFrame(step);
  }

  // Shows something else.
  ask(wish) {
    this.wish = { ...this.wish, ...wish };
    const index = this.shown;
    this.shown = -1;
    if (this.buffer) this.show(index);
  }
}

// Returns where the first of sorted times is that is after one.
function firstAfter(times, time) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] > time) high = middle;
    else low = middle + 1;
  }
  return low;
}
