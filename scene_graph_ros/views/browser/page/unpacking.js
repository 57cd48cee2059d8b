// Unpacks the pictures that cover something before a message that has some is handed on.

const AS_IT_IS = { premultiplyAlpha: "none", colorSpaceConversion: "none" };

export class Unpacking {
  constructor(onBlocks) {
    this.onBlocks = onBlocks;
    this.last = null;  // what is waited for
    this.known = new WeakMap();  // images by buffer and place: a recording tells them again
  }

  // Takes the blocks of a message. They are handed on in their order: at once if nothing is waited
  // for.
  take(blocks) {
    const packed = blocks.filter(({ kind }) => kind === "texture");
    if (!packed.length && !this.last) {
      this.onBlocks(blocks);
      return;
    }
    const turn = Promise.all([this.last, ...packed.map((block) => this.unpack(block))]).then(() => {
      if (this.last === turn) this.last = null;
      this.onBlocks(blocks);
    });
    this.last = turn;
  }

  async unpack(block) {
    const { buffer, byteOffset } = block.file;
    if (!this.known.has(buffer)) this.known.set(buffer, new Map());
    const images = this.known.get(buffer);
    if (!images.has(byteOffset)) images.set(byteOffset, imageOf(block.file));
    block.image = await images.get(byteOffset);
  }
}

// Returns null for a file that can't be read, such as a damaged one, and says so.
async function imageOf(file) {
  try {
    return await createImageBitmap(new Blob([file], { type: "image/png" }), AS_IT_IS);
  } catch (error) {
    console.error(`a picture can't be shown: ${error.message}`);
    return null;
  }
}
