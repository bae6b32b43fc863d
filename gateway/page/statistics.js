// The times of pictures: a table of the last seconds, and all of them as CSV.

const KEPT = 20000;
const WINDOW_MS = 5000;
const PARTS = ["page", "network", "to_send", "cluster_network", "set", "credit", "queue", "reconstruct", "encode", "send", "forward",
  "decode", "paint"];

/** The parts of a picture's age: what neither the page nor the gateway accounts for is the network's. All in ms. */
export function partsOf(picture) {
  const { header, posedAt, sentAt, receivedAt, decodedAt, paintedAt } = picture;
  const times = header.times_ms;
  const parts = { ...times, page: sentAt - posedAt, decode: decodedAt - receivedAt, paint: paintedAt - decodedAt };
  parts.network = receivedAt - sentAt - times.gateway;
  delete parts.gateway;
  return parts;
}

export function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : NaN;
}

export class Statistics {
  constructor() {
    this.pictures = [];
    this.replaced = 0;
  }

  /** A picture on the screen. */
  add(picture) {
    const age = picture.paintedAt - picture.posedAt;
    this.replaced += picture.header.replaced;
    this.pictures.push({ ...picture, age, parts: partsOf(picture) });
    if (this.pictures.length > KEPT) this.pictures.shift();
    return age;
  }

  /** Rows of name and value. */
  rows(now, plan) {
    const recent = this.pictures.filter((picture) => now - picture.paintedAt < WINDOW_MS && !picture.isRepeat);
    const last = this.pictures[this.pictures.length - 1];
    if (!last) return [["pictures", "none yet"]];
    const moving = recent.filter((picture) => !picture.header.still);
    const ages = moving.map((picture) => picture.age);
    const ms = (value) => (Number.isFinite(value) ? `${value.toFixed(1)} ms` : "–");
    const sum = recent.reduce((bytes, picture) => bytes + picture.bytes, 0);
    const seconds = WINDOW_MS / 1000;
    const parts = PARTS.map((name) => [`  ${name.replace("_", " ")}`, ms(quantile(moving.map((p) => p.parts[name]), 0.5))]);
    return [
      ["pictures a second", (recent.length / seconds).toFixed(1)],
      ["kB a second", (sum / seconds / 1000).toFixed(0)],
      ["size", `${last.header.size_px.join("×")} ${last.header.media_type.slice(6)}`],
      ["age in motion, median", ms(quantile(ages, 0.5))],
      ["age in motion, 95 %", ms(quantile(ages, 0.95))],
      ...parts,
      ["sample set, cell", `${last.header.set}, ${last.header.cell}${last.header.neighbour ? " (neighbour)" : ""}`],
      ["compositor", last.header.compositor],
      ["plan", plan ? `${plan.epoch}: ${plan.policy}` : "–"],
      ["poses replaced", this.replaced],
    ];
  }

  csv() {
    const names = ["number", "still", "width_px", "height_px", "bytes", "age_ms", ...PARTS.map((part) => `${part}_ms`)];
    const row = (p) => [p.header.number, p.header.still, ...p.header.size_px, p.bytes, p.age.toFixed(3),
      ...PARTS.map((part) => p.parts[part].toFixed(3))];
    return [names, ...this.pictures.map(row)].map((fields) => fields.join(",")).join("\n") + "\n";
  }
}
