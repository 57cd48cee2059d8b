// Forms of size 1: each vertex is its place (x, y, z), which is stretched, a shift along z, of half
// the length of a capsule, and its normal. A form's triangles are counter-clockwise from outside.

const SEGMENTS = 32, RINGS = 16;
const FEW_SEGMENTS = 12, FEW_RINGS = 6;  // of what is seen small

class Form {
  constructor() { this.vertices = []; this.triangles = []; }

  vertex(place, shift, normal) { return this.vertices.push(...place, shift, ...normal) / 7 - 1; }

  quad(a, b, c, d) { this.triangles.push(a, b, c, a, c, d); }

  done() {
    return { vertices: new Float32Array(this.vertices), triangles: new Uint32Array(this.triangles) };
  }
}

// Half circles from the lower pole to the upper one; `gap` shifts the halves apart.
function ball(gap, segments = SEGMENTS, rings = RINGS) {
  const form = new Form(), rows = [];
  for (let ring = 0; ring <= rings; ring++) {
    const halves = gap && 2 * ring === rings ? [-1, 1] : [gap ? Math.sign(2 * ring - rings) : 0];
    for (const shift of halves) {
      const row = [], latitude = Math.PI * (ring / rings - 0.5);
      for (let k = 0; k <= segments; k++) {
        const angle = 2 * Math.PI * k / segments;
        const place = [Math.cos(latitude) * Math.cos(angle), Math.cos(latitude) * Math.sin(angle),
          Math.sin(latitude)];
        row.push(form.vertex(place, shift, place));
      }
      rows.push(row);
    }
  }
  for (let k = 1; k < rows.length; k++) {
    const [low, high] = [rows[k - 1], rows[k]];
    for (let j = 0; j < segments; j++) form.quad(low[j], low[j + 1], high[j + 1], high[j]);
  }
  return form.done();
}

function box() {
  const form = new Form();
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [-1, 1]) {
      const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) => {
        const place = [0, 0, 0], normal = [0, 0, 0];
        normal[axis] = place[axis] = side;
        place[(axis + 1) % 3] = side * u;
        place[(axis + 2) % 3] = v;
        return form.vertex(place, 0, normal);
      });
      form.quad(...corners);
    }
  }
  return form.done();
}

function cylinder(segments = SEGMENTS) {
  const form = new Form();
  const lids = [-1, 1].map((side) => ({ side, middle: form.vertex([0, 0, side], 0, [0, 0, side]) }));
  for (let k = 0; k < segments; k++) {
    const [a, b] = [k, k + 1].map((j) => 2 * Math.PI * j / segments)
      .map((angle) => [Math.cos(angle), Math.sin(angle)]);
    const wall = [[a, -1], [b, -1], [b, 1], [a, 1]]
      .map(([[x, y], z]) => form.vertex([x, y, z], 0, [x, y, 0]));
    form.quad(...wall);
    for (const { side, middle } of lids) {
      const [from, to] = (side > 0 ? [a, b] : [b, a])
        .map(([x, y]) => form.vertex([x, y, side], 0, [0, 0, side]));
      form.triangles.push(middle, from, to);
    }
  }
  return form.done();
}

// A ring about z.
function ring(thickness) {
  const form = new Form(), rows = [];
  for (let j = 0; j <= 2 * SEGMENTS; j++) {
    const angle = Math.PI * j / SEGMENTS, out = [Math.cos(angle), Math.sin(angle)], row = [];
    for (let k = 0; k <= FEW_SEGMENTS; k++) {
      const turn = 2 * Math.PI * k / FEW_SEGMENTS, [flat, high] = [Math.cos(turn), Math.sin(turn)];
      const normal = [flat * out[0], flat * out[1], high];
      const place = [out[0] + thickness * normal[0], out[1] + thickness * normal[1], thickness * high];
      row.push(form.vertex(place, 0, normal));
    }
    rows.push(row);
  }
  for (let j = 1; j < rows.length; j++) {
    const [one, two] = [rows[j - 1], rows[j]];
    for (let k = 0; k < FEW_SEGMENTS; k++) form.quad(one[k], two[k], two[k + 1], one[k + 1]);
  }
  return form.done();
}

// A mesh as it came, each triangle with corners of its own, and a colour where there is paint: its
// four bytes in one integer. What is covered has parts of one texture each. Without normals of the
// corners a triangle is flat.
export function meshForm(vertices, triangles, paint = null, cover = null, normals = null) {
  const result = new Float32Array(7 * triangles.length);
  const at = (corner, k) => vertices[3 * triangles[corner] + k];
  for (let corner = 0; corner < triangles.length; corner += 3) {
    const u = [0, 1, 2].map((k) => at(corner + 1, k) - at(corner, k));
    const v = [0, 1, 2].map((k) => at(corner + 2, k) - at(corner, k));
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(...n) || 1;
    for (let j = 0; j < 3; j++) {
      for (let k = 0; k < 3; k++) {
        result[7 * (corner + j) + k] = at(corner + j, k);
        result[7 * (corner + j) + 4 + k] = normals?.[3 * (corner + j) + k] ?? n[k] / length;
      }
    }
  }
  const colors = paint && new Uint32Array(triangles.length);
  colors?.forEach((_, corner) => { colors[corner] = paint[Math.floor(corner / 3)]; });
  return { vertices: result, triangles: null, colors, coordinates: cover?.coordinates,
    parts: cover && partsOf(cover.textures) };
}

// Which corners have which texture: triangles of one texture stand together.
function partsOf(textures) {
  const parts = [];
  textures.forEach((texture, triangle) => {
    const last = parts.at(-1);
    if (last?.texture === texture) last.count += 3;
    else parts.push({ texture, begin: 3 * triangle, count: 3 });
  });
  return parts;
}

export const FORMS = { ellipsoid: ball(false), capsule: ball(true), box: box(), cylinder: cylinder(),
  ring: ring(0.02), "wide ring": ring(0.08),
  "small ellipsoid": ball(false, FEW_SEGMENTS, FEW_RINGS),
  "small capsule": ball(true, FEW_SEGMENTS, FEW_RINGS), "small cylinder": cylinder(FEW_SEGMENTS) };

// The forms of what is seen smaller than this: its outline is off by less than half a pixel.
export const SMALL = { ellipsoid: "small ellipsoid", capsule: "small capsule",
  cylinder: "small cylinder" };
export const SMALL_PIXELS = 0.5 / (1 - Math.cos(Math.PI / FEW_SEGMENTS));

// How far a form is stretched, and how far the halves of a capsule are from its middle.
export const STRETCH = {
  ellipsoid: (size) => [...size, 0],
  box: (size) => [...size.map((value) => value / 2), 0],
  cylinder: ([a, b, length]) => [a, b, length / 2, 0],
  capsule: ([a, b, length]) => [a, b, a, length / 2],
  mesh: () => [1, 1, 1, 0],
  vertices: () => [1, 1, 1, 0],
};

// How far a form reaches from its middle, stretched so.
export const REACH = {
  ellipsoid: ([a, b, c]) => Math.max(a, b, c),
  box: ([a, b, c]) => Math.hypot(a, b, c),
  cylinder: ([radius, , half]) => Math.hypot(radius, half),
  capsule: ([radius, , , half]) => radius + half,
};
