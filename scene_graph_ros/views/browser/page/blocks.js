// Reads the messages that ../blocks.py writes: blocks, whose numbers are read where they are.

const TIME = 1, SCENE = 2, MESH = 3, POSES = 4, VERTICES = 5, CONTACTS = 6,
  SURFACES = 7, PICTURE = 8, SLIDERS = 9, TROUBLES = 10, TEXTURE = 11,
  MOTION = 12, PLAN = 13;
const text = new TextDecoder();

// Takes arrays one after another.
class Reader {
  constructor(buffer, place) { this.buffer = buffer; this.place = place; }

  take(type, count) {
    const result = new type(this.buffer, this.place, count);
    this.place += result.byteLength;
    return result;
  }
}

// Reads where bodies are at some moments, and JSON that goes with it.
const moving = (kind) => (reader, length) => {
  const end = reader.place + length, [bodies, moments] = reader.take(Uint32Array, 2);
  const geometries = reader.take(Float64Array, bodies);
  const positions = reader.take(Float64Array, 3 * bodies * moments);
  const rotations = reader.take(Float32Array, 4 * bodies * moments);
  const content = JSON.parse(text.decode(reader.take(Uint8Array, end - reader.place)));
  return { kind, geometries, moments, positions, rotations, ...content };
};

const READERS = {
  [TIME](reader) {
    const [stamp, sequence, version] = reader.take(Float64Array, 3);
    return { kind: "time", stamp, sequence, version };
  },
  [SCENE](reader, length) {
    return { kind: "scene", ...JSON.parse(text.decode(reader.take(Uint8Array, length))) };
  },
  [MESH](reader) {
    const [number] = reader.take(Float64Array, 1);
    const [vertices, triangles, painted, covered, rounded] = reader.take(Uint32Array, 6);
    return { kind: "mesh", number, vertices: reader.take(Float32Array, 3 * vertices),
      triangles: reader.take(Uint32Array, 3 * triangles),
      paint: painted ? reader.take(Uint32Array, painted) : null,
      cover: covered ? { textures: reader.take(Uint32Array, covered),
        coordinates: reader.take(Float32Array, 6 * covered) } : null,
      normals: rounded ? reader.take(Float32Array, 9 * rounded) : null };
  },
  [TEXTURE](reader) {
    const [number] = reader.take(Float64Array, 1), [count] = reader.take(Uint32Array, 2);
    return { kind: "texture", number, file: reader.take(Uint8Array, count) };
  },
  [POSES](reader) {
    const [count] = reader.take(Uint32Array, 2);
    return { kind: "poses", numbers: reader.take(Float64Array, count),
      positions: reader.take(Float64Array, 3 * count),
      rotations: reader.take(Float32Array, 4 * count) };
  },
  [VERTICES](reader) {
    const [count] = reader.take(Uint32Array, 2);
    const [number, ...origin] = reader.take(Float64Array, 4);
    return { kind: "vertices", number, origin, vertices: reader.take(Float32Array, 3 * count) };
  },
  [CONTACTS](reader) {
    const [count] = reader.take(Uint32Array, 2);
    return { kind: "contacts", count, points: reader.take(Float64Array, 3 * count),
      pairs: reader.take(Float64Array, 2 * count), normals: reader.take(Float32Array, 3 * count), depths: reader.take(Float32Array, count) };
  },
  [SURFACES](reader) {
    const [count] = reader.take(Uint32Array, 2);
    const [scale, ...origin] = reader.take(Float64Array, 4);
    return { kind: "surfaces", count, scale, origin, corners: reader.take(Float32Array, 3 * count),
      pressures: reader.take(Float32Array, count) };
  },
  [PICTURE](reader) {
    const [count] = reader.take(Uint32Array, 2);
    return { kind: "picture", file: reader.take(Uint8Array, count) };
  },
  [MOTION]: moving("motion"),
  [PLAN]: moving("plan"),
  [TROUBLES](reader, length) {
    return { kind: "troubles", rows: JSON.parse(text.decode(reader.take(Uint8Array, length))) };
  },
  [SLIDERS](reader, length) {
    return { kind: "sliders", ...JSON.parse(text.decode(reader.take(Uint8Array, length))) };
  },
};

// Returns the blocks of a message, or of that part of a buffer; throws for one of an unknown kind.
export function readBlocks(buffer, begin = 0, end = buffer.byteLength) {
  const view = new DataView(buffer), blocks = [];
  for (let place = begin; place < end;) {
    const kind = view.getUint32(place, true), length = view.getUint32(place + 4, true);
    const read = READERS[kind];
    if (!read) throw new Error(`unknown kind of block: ${kind}`);
    blocks.push(read(new Reader(buffer, place + 8), length));
    place += 8 + length;
  }
  return blocks;
}
