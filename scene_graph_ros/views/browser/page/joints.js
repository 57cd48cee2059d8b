// Sliders for the joints that may be moved.

const PAUSE = 70;  // ms between two messages: the server takes twenty a second

const make = (tag, properties = {}, ...children) => {
  const result = Object.assign(document.createElement(tag), properties);
  result.append(...children);
  return result;
};

export class Joints {
  // onMove is told robot, joint and position of what was moved.
  constructor(section, onMove) {
    this.section = section;
    this.onMove = onMove;
    this.rows = [];
    this.wanted = new Map();
    this.timer = null;
    this.told = "";
  }

  // Offers sliders {robot, joint, lower, upper, unit}, where they are other ones than before.
  list(sliders) {
    const told = JSON.stringify(sliders);
    if (told === this.told) return;
    this.told = told;
    this.rows = sliders.map((slider) => this.row(slider));
    const robots = [...new Set(sliders.map((slider) => slider.robot))];
    this.notes = new Map(robots.map((robot) => [robot, make("p", { hidden: true })]));
    this.section.replaceChildren(...robots.map((robot) => make("details", { open: robots.length === 1 },
      make("summary", { textContent: `joints of ${robot}` }), this.notes.get(robot),
      ...this.rows.filter((row) => row.robot === robot).map((row) => row.label))));
    this.section.hidden = !robots.length;
  }

  row({ robot, joint, lower, upper, unit }) {
    const input = make("input", { type: "range", min: lower, max: upper, step: "any", title: joint });
    const output = make("output"), row = { robot, joint, unit, input, output, isHeld: false };
    input.addEventListener("input", () => {
      this.say(row);
      this.wanted.set(row, Number(input.value));
      if (this.timer === null) this.send();
    });
    // What is held by a finger goes where that is, and not where the node says.
    input.addEventListener("pointerdown", () => { row.isHeld = true; });
    ["pointerup", "pointercancel", "change"].forEach((kind) => (
      input.addEventListener(kind, () => { row.isHeld = false; })));
    row.label = make("label", {}, make("span", { className: "name", textContent: joint }), input, output);
    return row;
  }

  send() {
    const [next] = this.wanted;
    this.timer = next ? setTimeout(() => this.send(), PAUSE) : null;
    if (!next) return;
    const [row, position] = next;
    this.wanted.delete(row);
    this.onMove(row.robot, row.joint, position);
  }

  // Takes where joints are, and why those of some robots can't be moved.
  take({ positions, refused }) {
    this.rows.forEach((row, k) => {
      row.input.disabled = row.robot in refused;
      if (row.isHeld || this.wanted.has(row)) return;
      row.input.value = positions[k];
      this.say(row);
    });
    for (const [robot, note] of this.notes ?? []) {
      note.hidden = !(robot in refused);
      note.textContent = refused[robot] ?? "";
    }
  }

  say({ input, output, unit }) { output.textContent = `${Number(input.value).toFixed(3)} ${unit}`; }
}
