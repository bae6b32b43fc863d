// The status of the cluster, asked for once a second. Whatever the gateway leaves out is shown as a dash.

import { requestJson } from "./api.js";
import { $, element } from "./dom.js";

const POLL_MS = 1000;
const UNKNOWN = "–";

const whole = (value) => (Number.isFinite(value) ? String(Math.round(value)) : UNKNOWN);
const percent = (value) => (Number.isFinite(value) ? `${(100 * value).toFixed(0)} %` : UNKNOWN);
const list = (values) => (values?.length ? values.join(", ") : UNKNOWN);

/** A duration with its unit. */
function time(seconds) {
  if (!Number.isFinite(seconds)) return UNKNOWN;
  if (seconds === 0) return "0 s";
  if (seconds < 1) return `${(1000 * seconds).toPrecision(3)} ms`;
  return seconds < 120 ? `${seconds.toPrecision(3)} s` : `${(seconds / 60).toFixed(0)} min`;
}

function figures(pairs) {
  return pairs.map(([name, value]) => element("div", element("dt", name), element("dd", value)));
}

/** A table whose first column names its rows; `chosen(index)` marks rows. */
function table(caption, heads, rows, chosen = () => false) {
  const head = (scope) => (text) => Object.assign(element("th", text), { scope });
  const line = ([first, ...others], i) => {
    const row = element("tr", head("row")(first), ...others.map((text) => element("td", text)));
    row.classList.toggle("chosen", chosen(i));
    return row;
  };
  const header = element("thead", element("tr", ...heads.map(head("col"))));
  return element("table", element("caption", caption), header, element("tbody", ...rows.map(line)));
}

function wide(made) {
  const box = element("div", made);
  box.className = "wide";
  return box;
}

const drawn = new Map();

/** Draws a part of the page anew where its values differ, so that a selected text stays selected. */
function draw(id, values, make) {
  const text = JSON.stringify(values);
  if (drawn.get(id) === text) return;
  drawn.set(id, text);
  $(id).replaceChildren(...make());
}

function show(status) {
  const { nodes, workloads } = status;
  const summary = [
    ["P, nodes", whole(nodes?.length)], ["Visitors", whole(status.visitors)], ["Workloads", whole(workloads?.length)],
    ["Plan", whole(status.plan_epoch)], ["Scenes", list(status.scenes)], ["Version", status.version ?? UNKNOWN],
  ];
  draw("figures", summary, () => figures(summary));
  draw("nodes", nodes ?? [], () => {
    const rows = (nodes ?? []).map((node) => [node.name ?? UNKNOWN, node.device ?? UNKNOWN, list(node.roles), percent(node.busy_ratio)]);
    return [table(rows.length ? "" : "No node has joined.", ["Node", "Device", "Roles", "Busy"], rows)];
  });
  draw("workloads", workloads ?? [], () => (workloads ?? []).map(workloadSection));
}

function workloadSection(workload) {
  const { plan } = workload;
  const name = element("h2", `Workload ${workload.number ?? UNKNOWN}`);
  const numbers = element("dl", ...figures([
    ["Sessions", whole(workload.sessions)], ["Viewers", whole(workload.viewers)], ["Views a set", whole(workload.views_per_set)],
    ["Utilisation", percent(workload.utilisation)], ...(plan ? planFigures(plan) : []), ...lightFigures(workload.shared_light),
  ]));
  numbers.className = "figures";
  const promise = workload.promise ? [element("p", workload.promise)] : [];
  const section = element("section", name, numbers, ...promise, ...(plan ? planParts(plan) : [element("p", "No plan is in force.")]));
  section.className = "panel";
  return section;
}

function planFigures(plan) {
  const nodes = new Set([...(plan.samplers ?? []), ...(plan.compositors ?? [])]);
  return [
    ["Plan", whole(plan.epoch)], ["Policy", plan.policy ?? UNKNOWN], ["P, nodes of the plan", whole(nodes.size || NaN)],
    ["K, samplers", whole(plan.samplers?.length)], ["View cells", whole(plan.cells)], ["Common cells", whole(plan.common_cells)],
  ];
}

/** How much of a view's light samples know, and where its time goes; nothing where views take no light from samples. */
function lightFigures(light) {
  if (!light) return [];
  return [
    ["Known light", percent(light.known_ratio)], ["Surfaces of a view", time(light.surfaces_s)],
    ["Look-up", time(light.look_up_s)], ["Unknown points", time(light.unknown_points_s)],
  ];
}

function planParts(plan) {
  const roles = [["Samplers", list(plan.samplers)], ["Compositors", list(plan.compositors)]];
  return [
    ...(plan.reason ? [element("h3", "Reason"), element("p", plan.reason)] : []),
    element("h3", "Roles"), wide(table("", ["Role", "Nodes"], roles)),
    ...(plan.policies?.length ? [element("h3", "Policies"), wide(policyTable(plan))] : []),
    ...(plan.costs ? [element("h3", "Costs"), wide(table("", ["Cost", "Value"], costRows(plan.costs)))] : []),
  ];
}

function policyTable({ policies, policy }) {
  const ratio = ({ predicted_s, achieved_s }) =>
    (Number.isFinite(achieved_s) && predicted_s > 0 ? `${(achieved_s / predicted_s).toFixed(2)} ×` : UNKNOWN);
  const name = (row) => (row.policy === policy ? `${row.policy} (in force)` : row.policy ?? UNKNOWN);
  const rows = policies.map((row) => [name(row), time(row.predicted_s), time(row.achieved_s), ratio(row)]);
  const heads = ["Policy", "Predicted", "Achieved", "Achieved / predicted"];
  return table("Time of one sample set and its views", heads, rows, (i) => policies[i].policy === policy);
}

/** Rows of costs, whatever their names, which end in _s. */
function costRows(costs) {
  return Object.entries(costs).map(([name, value]) => [name.replace(/_s$/, "").replaceAll("_", " "), time(value)]);
}

/** Says whether the figures are of now; unchanged words are not spoken again. */
function tell(text, isLate) {
  if ($("updated").textContent !== text) $("updated").textContent = text;
  $("updated").classList.toggle("late", isLate);
}

let timer = null;

async function poll() {
  clearTimeout(timer);
  if (document.hidden) return tell("Paused while hidden.", true);
  try {
    show(await requestJson("status.json", "", AbortSignal.timeout(10 * POLL_MS)));
    tell("Now, every second.", false);
  } catch (error) {
    tell(error.name === "TimeoutError" ? "The gateway does not answer." : error.message, true);
  }
  clearTimeout(timer);
  timer = setTimeout(poll, POLL_MS);
}

document.addEventListener("visibilitychange", poll);
poll();
