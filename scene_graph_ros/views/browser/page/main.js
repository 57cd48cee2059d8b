// The page: what comes is drawn, what is chosen is asked for.

import { Camera } from "./camera.js";
import { Connection } from "./connection.js";
import { Joints } from "./joints.js";
import { Motion } from "./motion.js";
import { Picture } from "./picture.js";
import { Recording } from "./recording.js";
import { Renderer } from "./renderer.js";
import { Selection } from "./selection.js";
import { Tree } from "./tree.js";
import { Unpacking } from "./unpacking.js";
import { World } from "./world.js";

const $ = (selector) => document.querySelector(selector);
const root = document.documentElement;

// Counts what happens, and tells how often in the last second.
class Rate {
  constructor() { this.marks = [[performance.now(), 0]]; }

  value(total) {
    const now = performance.now();
    this.marks.push([now, total]);
    while (this.marks.length > 2 && now - this.marks[0][0] > 1000) this.marks.shift();
    const [begin, first] = this.marks[0];
    return now > begin ? 1000 * (total - first) / (now - begin) : 0;
  }
}

const renderer = new Renderer($("#view"));
const world = new World(renderer);
const motion = new Motion($("#motion"), { canvas: $("#view"), renderer,
  onAsk: (request) => connection.request(request), onChange: redraw });
const camera = new Camera($("#view"), redraw, select, (event) => motion.grab(event, camera));
const selection = new Selection($("#selection"), world);
const tree = new Tree($("#tree"), redraw);
let isDue = false, isFitted = false, pictures = 0;

function redraw() {
  if (!isDue) {
    isDue = true;
    requestAnimationFrame(draw);
  }
}

function draw() {
  isDue = false;
  pictures += 1;
  const background = root.dataset.theme === "light" ? [0.953, 0.957, 0.965] : [0.078, 0.09, 0.11];
  const { eye } = camera.view(1);
  renderer.draw(camera, motion.dress(world.picture(eye), eye), background);
  document.body.dataset.pictures = pictures;
}

// Returns what is seen at the place of an event, null for nothing.
function itemAt(event) {
  const ratio = $("#view").width / $("#view").clientWidth;
  const { bodies } = world.picture(camera.view(1).eye);
  const found = renderer.bodyAt(camera, bodies, ratio * event.offsetX, ratio * event.offsetY);
  redraw();
  return found < 0 ? null : bodies[found];
}

function select(event) { selection.select(itemAt(event)?.number ?? null); }

// Lists what the node's diagnostics say that is not as it should be.
function showTroubles(rows) {
  $("#troubles").hidden = !rows.length;
  $("#troubles").replaceChildren(...rows.map(({ level, name, text }) => (
    Object.assign(document.createElement("p"), { className: level, textContent: `${name}: ${text}` }))));
}

function fit() {
  const bounds = world.bounds();
  if (bounds) camera.fit(bounds.middle, bounds.radius);
}

function take(blocks) {
  if (world.take(blocks)) {
    const items = [...world.items.values()];
    tree.show(items);
    picture.list(world.cameras);
    joints.list(world.sliders);
    motion.list(world.draggable);
    document.body.dataset.items = items.length;
    for (const box of document.querySelectorAll("[data-role]")) {
      box.checked = world.roles.includes(box.dataset.role);
      box.parentElement.querySelector("output").textContent = world.counts[box.dataset.role];
    }
  }
  blocks.filter((block) => block.kind === "picture").forEach((block) => picture.take(block.file));
  blocks.filter((block) => block.kind === "sliders").forEach((block) => joints.take(block));
  if (blocks.some((block) => block.begins)) motion.forget();
  blocks.filter((block) => block.kind === "motion").forEach((block) => motion.take(block));
  blocks.filter((block) => block.kind === "plan").forEach((block) => motion.takePlan(block));
  if (blocks.some((block) => block.begins)) showTroubles([]);
  blocks.filter((block) => block.kind === "troubles").forEach((block) => showTroubles(block.rows));
  if (!isFitted && world.bounds()) {
    isFitted = true;
    fit();
  }
  const { surfaces } = world;
  $("#pressure").hidden = !surfaces?.count;
  if (surfaces) {
    const red = Number((surfaces.scale / 1000).toPrecision(3));
    $("#pressure-scale").textContent = `${red} kPa`;
  }
  redraw();
}

const picture = new Picture($("#picture"), $("#looking"), (camera) => connection.ask({ camera }));
const joints = new Joints($("#joints"), (...move) => connection.move(...move));
const say = (isOpen, text) => {
  $("#status").textContent = text;
  $("#status").toggleAttribute("data-is-open", isOpen);
};
// A file has what it shows in it.
const recorded = $("#recording");
const unpacking = new Unpacking(take);
const hand = (blocks) => unpacking.take(blocks);
const connection = recorded
  ? new Recording(recorded, $("#timeline"), hand, say) : new Connection(hand, say);

for (const box of document.querySelectorAll("[data-role]")) {
  box.addEventListener("change", () => {
    const chosen = [...document.querySelectorAll("[data-role]")].filter((each) => each.checked);
    connection.ask({ roles: chosen.map((each) => each.dataset.role) });
  });
}
$("#contacts").addEventListener("change", (event) => connection.ask({ contacts: event.target.checked }));
$("#filter").addEventListener("input", (event) => tree.find(event.target.value));
$("#fit").addEventListener("click", fit);
const fold = (isFolded) => {
  $("#panel").toggleAttribute("data-is-folded", isFolded);
  $("#fold").setAttribute("aria-expanded", String(!isFolded));
  $("#fold").textContent = isFolded ? "▸" : "▾";
};
$("#fold").addEventListener("click", () => fold(!$("#panel").hasAttribute("data-is-folded")));
// On a phone the scene comes first.
fold(window.matchMedia("(max-width: 640px)").matches);
$("#theme").addEventListener("click", () => {
  root.dataset.theme = root.dataset.theme === "light" ? "dark" : "light";
  redraw();
});
root.dataset.theme = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
window.addEventListener("resize", redraw);
$("#view").addEventListener("dblclick", (event) => {
  const item = itemAt(event);
  if (item) motion.holdItem(item);
});
window.addEventListener("keydown", (event) => {
  if (["INPUT", "SELECT"].includes(event.target.tagName)) return;
  if (motion.press(event)) event.preventDefault();
  if (event.key === "f") fit();
  if (event.key === "Escape") selection.select(null);
  redraw();
});
$("#view").addEventListener("webglcontextlost", () => {
  $("#status").textContent = "graphics lost: reload";
});

const updateRate = new Rate(), pictureRate = new Rate();
setInterval(() => {
  const { time } = world;
  if (time) {
    // A stamp of the system's clock is a date, one of simulated time is not.
    $("#time").textContent = time.stamp > 1e9
      ? new Date(1000 * time.stamp).toLocaleTimeString() : `${time.stamp.toFixed(1)} s`;
    $("#updates").textContent = `${updateRate.value(time.sequence).toFixed(0)} Hz`;
  }
  $("#pictures").textContent = `${pictureRate.value(pictures).toFixed(0)} Hz`;
  selection.follow();
  $("#contact-count").textContent = world.contacts ? world.contacts.count : "-";
}, 250);
