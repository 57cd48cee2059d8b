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
    if (!images.has(byteOffset)) {
      const file = new Blob([block.file], { type: "image/png" });
      images.set(byteOffset, createImageBitmap(file, AS_IT_IS));
    }
    block.image = await images.get(byteOffset);
  }
}
