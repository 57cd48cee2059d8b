// Names of sources, frames and geometries, with boxes that hide them.

const MANY = 60;  // frames, above which the tree is closed at first

function element(tag, properties = {}, ...children) {
  const result = Object.assign(document.createElement(tag), properties);
  result.append(...children);
  return result;
}

export class Tree {
  constructor(root, onChange) {
    this.root = root;
    this.onChange = onChange;
    this.word = "";
    this.items = [];
    this.open = new Map();
  }

  // Lists items; what was opened or closed by hand stays so.
  show(items) {
    this.items = items;
    this.build();
  }

  find(word) {
    this.word = word.trim().toLowerCase();
    this.build();
  }

  build() {
    const found = this.items.filter((item) => item.path.join("/").toLowerCase().includes(this.word));
    const sources = new Map();
    for (const item of found) {
      const [, source, frame] = item.path;
      if (!sources.has(source)) sources.set(source, new Map());
      const frames = sources.get(source);
      if (!frames.has(frame)) frames.set(frame, []);
      frames.get(frame).push(item);
    }
    const isSmall = [...sources.values()].reduce((sum, frames) => sum + frames.size, 0) <= MANY;
    this.boxes = [];
    this.root.replaceChildren(...[...sources].map(([source, frames]) => this.branch(
      source, [...frames.values()].flat(), isSmall,
      [...frames].map(([frame, own]) => this.branch(`${source}\n${frame}`, own, false,
        own.map((item) => this.leaf(item)))))));
    this.follow();
  }

  branch(key, items, isOpen, children) {
    const name = key.split("\n").pop();
    const details = element("details", { open: this.open.get(key) ?? (isOpen || this.word !== "") },
      element("summary", { title: name }, this.box(items),
        element("span", { className: "name", textContent: name }),
        element("span", { className: "kind", textContent: items.length })), ...children);
    details.querySelector("summary").addEventListener("click", (event) => {
      if (event.target.type !== "checkbox") this.open.set(key, !details.open);
    });
    return details;
  }

  leaf(item) {
    const [role, , , name] = item.path;
    const title = item.reason ? `not shown: ${item.reason}` : `${role}, ${item.shape}`;
    return element("label", { className: item.reason ? "leaf unshown" : "leaf", title },
      this.box([item]), element("span", { className: "name", textContent: name }),
      element("span", { className: "kind", textContent: item.shape }));
  }

  box(items) {
    const box = element("input", { type: "checkbox" });
    box.addEventListener("change", () => {
      items.forEach((item) => { item.isShown = box.checked; });
      this.follow();
      this.onChange();
    });
    this.boxes.push({ box, items });
    return box;
  }

  // Makes all boxes say what is shown.
  follow() {
    for (const { box, items } of this.boxes) {
      const shown = items.filter((item) => item.isShown).length;
      box.checked = shown > 0;
      box.indeterminate = shown > 0 && shown < items.length;
    }
  }
}
