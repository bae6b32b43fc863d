// The times of pictures: a table of the last seconds. Benchmarks read all of them.

const KEPT = 20000;
const WINDOW_MS = 5000;
const PARTS = ["page", "network", "to_send", "cluster_network", "set", "credit", "queue", "reconstruct", "encode", "send", "forward",
  "decode", "paint"];

/** The parts of a picture's age: what neither the page nor the gateway accounts for is the network's. All in ms. */
function partsOf(picture) {
  const { header, posedAt, sentAt, receivedAt, decodedAt, paintedAt } = picture;
  const times = header.times_ms;
  const parts = { ...times, page: sentAt - posedAt, decode: decodedAt - receivedAt, paint: paintedAt - decodedAt };
  parts.network = receivedAt - sentAt - times.gateway;
  delete parts.gateway;
  return parts;
}

function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : NaN;
}

function ms(value) {
  return Number.isFinite(value) ? `${value.toFixed(1)} ms` : "–";
}

function ratesOf(recent, last) {
  const seconds = WINDOW_MS / 1000;
  const sum = recent.reduce((bytes, picture) => bytes + picture.bytes, 0);
  const poses = recent.filter((picture) => !picture.isRepeat);
  return [
    ["pictures a second", (poses.length / seconds).toFixed(1)],
    ["kB a second", (sum / seconds / 1000).toFixed(0)],
    ["size", last.header.size_px.join("×")],
    ["quality", last.header.jpeg_quality ? `JPEG, ${last.header.jpeg_quality} of 100` : "lossless"],
    ["round trip, least", ms(last.header.rtt_ms ?? NaN)],
  ];
}

function agesOf(recent) {
  const moving = recent.filter((picture) => !picture.header.still && !picture.isRepeat);
  const ages = moving.map((picture) => picture.age);
  const median = (name) => quantile(moving.map((picture) => picture.parts[name]), 0.5);
  return [
    ["age in motion, 95 %", ms(quantile(ages, 0.95))],
    ["age in motion, median", ms(quantile(ages, 0.5))],
    ...PARTS.map((name) => [name.replace("_", " "), ms(median(name)), "part"]),
  ];
}

/** Where the last picture comes from. */
function originOf(header, lightSteps) {
  return [
    ["light", header.direct ? "drawn directly" : header.quality ? `shared, ${header.quality}` : "from samples"],
    ["light step", `${header.light_step} of ${lightSteps}`],
    ["samples a pixel", `${header.samples}`],
    ["sample set", header.set],
    ["view cell", `${header.cell}, ${header.neighbour ? "a neighbour's" : "the view's own"}`],
    ["compositor", header.compositor],
  ];
}

function planRows(plan) {
  if (!plan) return [["plan", "–"]];
  const promise = plan.promise ? [["promise", plan.promise, "text"]] : [];
  return [["plan", `${plan.epoch}: ${plan.policy}`], ["reason", plan.reason, "text"], ...promise];
}

export class Statistics {
  constructor() {
    this.pictures = [];
    this.replaced = 0;
    /** Pictures that came and were not shown, by reason. */
    this.drops = { late: 0, undecoded: 0 };
  }

  /** A picture on the screen, or one that is not shown, for a reason. Returns its age. */
  add(picture, dropReason) {
    const age = picture.paintedAt - picture.posedAt;
    this.replaced += picture.header.replaced;
    if (dropReason) this.drops[dropReason] += 1;
    else this.pictures.push({ ...picture, age, parts: partsOf(picture) });
    if (this.pictures.length > KEPT) this.pictures.shift();
    return age;
  }

  /** Rows of name and value; a third entry says that a row is a "part" of the one above, or a "text". */
  rows(now, plan, lightSteps) {
    const recent = this.pictures.filter((picture) => now - picture.paintedAt < WINDOW_MS);
    const last = this.pictures[this.pictures.length - 1];
    if (!last) return [["pictures", "none yet"]];
    const origin = originOf(last.header, lightSteps);
    return [
      ...ratesOf(recent, last), ...agesOf(recent), ...origin,
      ["dropped", this.replaced + this.drops.late + this.drops.undecoded],
      ["poses replaced", this.replaced, "part"],
      ["pictures late", this.drops.late, "part"],
      ["pictures not decoded", this.drops.undecoded, "part"],
      ...planRows(plan),
    ];
  }
}
