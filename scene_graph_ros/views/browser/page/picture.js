// What a camera of the scene sees, in a corner of the page.

export class Picture {
  // figure has a canvas and a caption; label a choice of cameras, which onChoice is told of.
  constructor(figure, label, onChoice) {
    this.figure = figure;
    this.label = label;
    this.choice = label.querySelector("select");
    this.canvas = figure.querySelector("canvas");
    this.count = this.shown = 0;
    this.choice.addEventListener("change", () => {
      this.show(null);
      onChoice(this.choice.value);
    });
  }

  // Offers cameras; the chosen one stays chosen, also while it is gone.
  list(cameras) {
    const chosen = this.choice.value;
    const names = chosen && !cameras.includes(chosen) ? [...cameras, chosen] : cameras;
    this.choice.replaceChildren(new Option("none", ""), ...names.map((name) => new Option(name)));
    this.choice.value = chosen;
    this.label.hidden = names.length === 0;
  }

  // Shows a file, unless a newer one was decoded first; an empty one is no picture.
  async take(file) {
    const number = ++this.count;
    const image = file.length ? await createImageBitmap(new Blob([file], { type: "image/png" })) : null;
    if (number > this.shown && this.choice.value) {
      this.shown = number;
      this.show(image);
    }
  }

  show(image) {
    const name = this.choice.value;
    this.figure.hidden = !name;
    this.canvas.hidden = !image;
    this.figure.querySelector("figcaption").textContent = image ? name : `${name}: no picture`;
    if (image) {
      this.canvas.width = image.width;
      this.canvas.height = image.height;
      this.canvas.getContext("2d").drawImage(image, 0, 0);
      image.close();
    }
  }
}
