// What the node said there is: items and where they are, meshes, contacts.

import { meshForm, REACH, STRETCH } from "./forms.js";
import { plus, turnZTo } from "./vectors.js";

const CONTACT_COLOR = [1, 0.25, 0.2, 1], NORMAL_COLOR = [1, 0.75, 0.2, 1];
const MARK = 0.004;  // of a contact, as seen: part of its distance from the eye
const ORIGIN = [0, 0, 0], UNTURNED = [0, 0, 0, 1];

export class World {
  constructor(renderer) {
    this.renderer = renderer;
    this.items = new Map();
    this.topologies = new Map();
    this.textures = new Set();
    this.reach = new Map();  // of each mesh: its farthest vertex from its origin
    this.hidden = new Set();
    this.contacts = this.surfaces = null;
    this.time = null;
    this.selected = null;  // the number of an item
  }

  // Takes a message; tells whether there are other items than before.
  take(blocks) {
    let changed = false;
    this.contacts = this.surfaces = null;
    if (blocks.some((block) => block.begins)) this.begin();
    for (const block of blocks) {
      if (block.kind === "time") this.time = block;
      else if (block.kind === "scene") { this.takeScene(block); changed = true; }
      else if (block.kind === "mesh") this.takeMesh(block);
      else if (block.kind === "texture") this.takeTexture(block);
      else if (block.kind === "poses") this.takePoses(block);
      else if (block.kind === "vertices") this.takeVertices(block);
      else if (block.kind === "contacts") this.contacts = block;
      else if (block.kind === "surfaces") this.surfaces = block;
    }
    return changed;
  }

  // Forgets what another server said, but not what was hidden by hand.
  begin() {
    this.hidden = new Set([...this.items.values()].filter((i) => !i.isShown).map(nameOf));
    this.items.clear();
    this.topologies.clear();
    [...this.reach.keys()].forEach((number) => this.renderer.dropMesh(number));
    this.reach.clear();
    this.textures.forEach((number) => this.renderer.dropTexture(number));
    this.textures.clear();
  }

  takeScene({ roles, counts, cameras, sliders, draggable, appeared, vanished, meshes_gone: gone,
    textures_gone: stale }) {
    this.roles = roles;
    this.cameras = cameras;
    this.sliders = sliders;
    this.draggable = draggable;
    this.counts = counts;
    vanished.forEach((number) => this.items.delete(number));
    for (const entry of appeared) {
      const before = this.items.get(entry.number);
      this.items.set(entry.number, {
        ...entry, isShown: before?.isShown ?? !this.hidden.has(nameOf(entry)), position: before?.position,
        rotation: before?.rotation, stretch: STRETCH[entry.form]?.(entry.size),
        batch: entry.mesh ?? entry.form,
      });
    }
    for (const number of gone) {
      this.topologies.delete(number);
      this.reach.delete(number);
      this.renderer.dropMesh(number);
    }
    for (const number of stale) {
      this.textures.delete(number);
      this.renderer.dropTexture(number);
    }
  }

  takeTexture({ number, image }) {
    this.textures.add(number);
    if (image) this.renderer.setTexture(number, image);
  }

  takeMesh({ number, vertices, triangles, paint, cover, normals }) {
    // The vertices of what deforms come by themselves.
    if (number < 0) this.topologies.set(number, triangles);
    else this.renderer.setMesh(number, meshForm(vertices, triangles, paint, cover, normals));
    this.reach.set(number, farthest(vertices));
  }

  takePoses({ numbers, positions, rotations }) {
    numbers.forEach((number, k) => {
      const item = this.items.get(number);
      if (!item) return;
      item.position = positions.slice(3 * k, 3 * k + 3);
      item.rotation = rotations.slice(4 * k, 4 * k + 4);
    });
  }

  takeVertices({ number, origin, vertices }) {
    const item = this.items.get(number);
    if (!item) return;
    this.renderer.setMesh(item.batch, meshForm(vertices, this.topologies.get(item.batch)));
    this.reach.set(item.batch, farthest(vertices));
    Object.assign(item, { position: origin, rotation: UNTURNED });
  }

  // Returns what is drawn now; `eye` is where it is seen from.
  picture(eye) {
    const placed = [...this.items.values()].filter((i) => i.isShown && i.position && !i.reason);
    const planes = placed.filter((item) => item.form === "half_space");
    const bodies = placed.filter((item) => item.form !== "half_space").map((item) => (
      item.number === this.selected ? { ...item, color: brighter(item.color) } : item));
    return { bodies, planes, marks: this.marks(eye), surfaces: this.surfaces };
  }

  // Returns what touches an item's geometry: the other's name, and how deep in m; deepest first.
  touching({ geometry }) {
    const { count = 0, pairs, depths } = this.contacts ?? {}, result = [];
    for (let k = 0; k < count; k++) {
      const pair = [pairs[2 * k], pairs[2 * k + 1]];
      if (!pair.includes(geometry)) continue;
      const other = pair[0] === geometry ? pair[1] : pair[0];
      const item = [...this.items.values()].find((each) => each.geometry === other);
      result.push({ name: item ? item.path.slice(1).join("/") : `geometry ${other}`,
        depth: depths[k] });
    }
    return result.sort((one, two) => two.depth - one.depth);
  }

  marks(eye) {
    const { count = 0, points, normals } = this.contacts ?? {}, result = [];
    for (let k = 0; k < count; k++) {
      const point = [...points.slice(3 * k, 3 * k + 3)];
      const normal = [...normals.slice(3 * k, 3 * k + 3)];
      const size = MARK * Math.hypot(...plus(point, eye, -1));
      result.push(
        { batch: "cylinder", position: plus(point, normal, 4 * size), rotation: turnZTo(normal),
          stretch: [0.25 * size, 0.25 * size, 4 * size, 0], color: NORMAL_COLOR },
        { batch: "ellipsoid", position: point, rotation: UNTURNED,
          stretch: [size, size, size, 0], color: CONTACT_COLOR });
    }
    return result;
  }

  // Returns the middle and radius of what is shown, half spaces left out; null if that is nothing.
  bounds() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const item of this.picture(ORIGIN).bodies) {
      const reach = this.reach.get(item.batch) ?? REACH[item.form](item.stretch);
      for (let k = 0; k < 3; k++) {
        low[k] = Math.min(low[k], item.position[k] - reach);
        high[k] = Math.max(high[k], item.position[k] + reach);
      }
    }
    if (!(low[0] <= high[0])) return null;
    const middle = low.map((value, k) => (value + high[k]) / 2);
    return { middle, radius: Math.hypot(...plus(high, middle, -1)) || 1 };
  }
}

const brighter = (color) => [...color.slice(0, 3).map((c) => 0.45 * c + 0.55), color[3]];
const nameOf = ({ path }) => path.join("\n");

function farthest(vertices) {
  let most = 0;
  for (let k = 0; k < vertices.length; k += 3) {
    most = Math.max(most, Math.hypot(vertices[k], vertices[k + 1], vertices[k + 2]));
  }
  return most;
}
