// Says of the item that was clicked what it is, where, and what it touches.

const MOST = 8;  // contacts that are listed
const PLACES = 4;  // of metres: a tenth of a millimetre

const fixed = (numbers) => [...numbers].map((n) => n.toFixed(PLACES)).join(" ");
const inMillimetres = (m) => `${(1000 * m).toPrecision(3)} mm`;

export class Selection {
  constructor(section, world) {
    this.section = section;
    this.world = world;
  }

  select(number) {
    this.world.selected = number;
    this.follow();
  }

  // Says how it is now.
  follow() {
    const item = this.world.items.get(this.world.selected);
    this.section.hidden = !item;
    if (!item) return;
    const [role, ...names] = item.path;
    const rows = [["name", names.join("/")], ["shape", `${item.shape}, ${role}`]];
    if (item.position) {
      rows.push(["at", `${fixed(item.position)} m`], ["turned (x, y, z, w)", fixed(item.rotation)]);
    }
    const touching = this.world.contacts ? this.world.touching(item) : null;
    rows.push(["touches", touching ? `${touching.length || "nothing"}` : "tick contacts"]);
    (touching ?? []).slice(0, MOST).forEach(({ name, depth }) => rows.push([inMillimetres(depth), name]));
    const lines = rows.flatMap(([term, text]) => ["dt", "dd"].map((tag, k) => (
      Object.assign(document.createElement(tag), { textContent: k ? text : term, title: text }))));
    this.section.querySelector("dl").replaceChildren(...lines);
  }
}
