// State, reasons, terms, link, log: what the board says, in the firmware's own words.

import { fixed } from "./view.js";

const element = (id) => document.getElementById(id);

function list(id, codes, bits, none) {
  const found = codes.filter((code) => bits & (1 << code.number));
  const key = `${bits} ${none}`;
  const parent = element(id);
  if (parent.dataset.shown === key) return;
  parent.dataset.shown = key;
  const items = found.map((code) => {
    const item = document.createElement("li");
    const name = document.createElement("strong");
    name.textContent = code.name;
    item.append(name, `: ${code.meaning}${code.effect ? ` (${code.effect})` : ""}`);
    if (code.remedy) {
      const remedy = document.createElement("span");
      remedy.className = "remedy quiet";
      remedy.textContent = `→ ${code.remedy}`;
      item.append(remedy);
    }
    return item;
  });
  if (!items.length) {
    const item = document.createElement("li");
    item.className = "none";
    item.textContent = none;
    items.push(item);
  }
  parent.replaceChildren(...items);
}

/** Writes a list of names and values; the elements stay, so that a screen reader is not disturbed. */
function pairs(parent, entries) {
  while (parent.children.length > 2 * entries.length) parent.lastChild.remove();
  entries.forEach(([name, value], n) => {
    if (!parent.children[2 * n]) parent.append(document.createElement("dt"), document.createElement("dd"));
    const [term, detail] = [parent.children[2 * n], parent.children[2 * n + 1]];
    if (term.textContent !== name) term.textContent = name;
    if (detail.textContent !== value) detail.textContent = value;
  });
}

const degrees = (rad) => `${fixed((rad * 180) / Math.PI, 1)}°`;

export function showState(words, vehicle, truth) {
  list("faults", words.faults, vehicle.faults, "none latched");
  const disarmed = vehicle.mode === "Disarmed";
  list("blockers", words.blockers, disarmed ? vehicle.blockers : 0, disarmed ? "nothing: the vehicle can be armed" : "the vehicle is armed");
  list("limits", words.limits, vehicle.limits, "none acts");
  const e = vehicle.estimate;
  pairs(element("numbers"), [
    ["Speed", `${fixed(e.speed_m_s, 2)} m/s`],
    ["Arm", degrees(e.phi_rad)],
    ["Slope", degrees(e.slope_rad)],
    ["Yaw rate", `${fixed(e.yaw_rate_rad_s, 2)} rad/s`],
    ["Spar, ballast", `${degrees(e.spar_rad)}, ${degrees(e.ballast_rad)}`],
    ["Supply", `${vehicle.battery_v.toFixed(1)} V`],
    ["Currents left, right, ballast", `${vehicle.current_a.map((each) => fixed(each, 1)).join(", ")} A`],
    ["Distance", `${fixed(e.distance_m, 2)} m`],
    ["Gyros", e.calibrated ? "calibrated" : "not calibrated"],
    ["Motion", e.sliding ? "slides" : e.stalled ? "blocked" : e.at_rest ? "at rest" : "moves"],
    ...(truth ? [["True speed, true arm", `${fixed(truth.speed_m_s, 2)} m/s, ${degrees(truth.phi_rad)}`]] : []),
  ]);
}

// Of each law: its terms and what they are called.
const LAWS = [
  ["Speed", "speed", ["feed_forward_v", "weight_v", "speed_feedback_v", "swing_rate_v", "swing_damping_v", "friction_v", "guard_v", "trim_v", "governed_v"]],
  ["Steering", "steering", ["feed_forward_v", "proportional_v", "integral_v", "hold_v"]],
  ["Levelling", "spar", ["spar_v", "ballast_v", "spar_rate_v", "ballast_rate_v", "feed_forward_v"]],
];
let bars;

function buildTerms() {
  bars = [];
  const table = document.createElement("table");
  for (const [name, law, terms] of LAWS) {
    const head = table.insertRow();
    const cell = document.createElement("th");
    cell.colSpan = 3;
    cell.scope = "rowgroup";
    cell.textContent = name;
    cell.style.textAlign = "left";
    head.append(cell);
    for (const term of terms) {
      const row = table.insertRow();
      row.insertCell().textContent = term.replace(/_v$/, "").replaceAll("_", " ");
      const value = row.insertCell();
      const bar = document.createElement("div");
      bar.className = "bar";
      const fill = document.createElement("i");
      bar.append(fill);
      row.insertCell().append(bar);
      bars.push({ law, term, value, fill });
    }
  }
  element("terms").replaceChildren(table);
}

export function showTerms(terms, supply) {
  if (!bars) buildTerms();
  const full = Math.max(supply, 1);
  for (const { law, term, value, fill } of bars) {
    const volts = terms[law][term];
    value.textContent = fixed(volts, 2);
    const share = Math.max(-1, Math.min(1, volts / full)) * 50;
    fill.style.left = `${50 + Math.min(share, 0)}%`;
    fill.style.width = `${Math.abs(share)}%`;
  }
}

export function showQuality(status, host, rateHz, ageMs) {
  const { cycles, link, clock, vehicle } = status;
  const cost = cycles.worst > 0
    ? [
        ["Tick, cycles", `${cycles.total}, worst ${cycles.worst}`],
        ["Sense, estimate, decide, actuate", `${cycles.sense}, ${cycles.estimate}, ${cycles.decide}, ${cycles.actuate}`],
      ]
    : [["Tick, cycles", "- (not counted by a simulated board)"]];
  pairs(element("quality"), [
    ["Statuses per second", rateHz.toFixed(0)],
    ["Since the last one", `${ageMs.toFixed(0)} ms`],
    ["Board: good, unreadable frames", `${link.frames}, ${link.bad_frames + link.overlong_frames}`],
    ["Board: repeated, foreign, late", `${link.repeated_frames}, ${link.foreign_frames}, ${link.late_orders}`],
    ["Board: dropped orders, answers", `${link.dropped_requests}, ${link.dropped_answers}`],
    ["Board: UART errors", `${link.uart_errors}`],
    ["Page: messages, unreadable frames", `${host.messages}, ${host.unreadable_frames}`],
    ["Page: repeated, unidentified", `${host.repeated_statuses}, ${host.unidentified}`],
    ["Page: received", `${(host.bytes / 1000).toFixed(0)} kB`],
    ...cost,
    ["Late ticks", `${vehicle.late_ticks}`],
    ["Refused to arm", `${vehicle.refused_arms}`],
    ["Clock", clock],
  ]);
}

const LOG_MAX = 400;

/** Adds lines to the log. */
export function log(lines) {
  if (!lines.length) return;
  const pre = element("log");
  const atEnd = pre.scrollTop + pre.clientHeight >= pre.scrollHeight - 8;
  const all = [...pre.textContent.split("\n").filter(Boolean), ...lines];
  pre.textContent = `${all.slice(-LOG_MAX).join("\n")}\n`;
  if (atEnd) pre.scrollTop = pre.scrollHeight;
}

/** Tells a person something for some seconds, and keeps it in the log. */
export function tell(text) {
  log([`  page: ${text}`]);
  const line = document.createElement("p");
  line.textContent = text;
  const told = element("told");
  told.append(line);
  while (told.children.length > 4) told.firstChild.remove();
  setTimeout(() => line.remove(), 6000);
}

const SHAPES = { Disarmed: "○", Armed: "●", Stopping: "◐", silent: "✕", none: "–" };
const WORDS = { Disarmed: "disarmed", Armed: "armed", Stopping: "stopping", silent: "board silent", none: "no board" };

export const modeWord = (mode) => WORDS[mode];

/** Shows the mode: as a word and as a shape, not by colour alone. */
export function showMode(mode, note) {
  const parent = element("mode");
  if (parent.dataset.mode !== mode) {
    parent.dataset.mode = mode;
    element("mode-shape").textContent = SHAPES[mode];
    element("mode-word").textContent = WORDS[mode];
  }
  if (element("bar-note").textContent !== note) element("bar-note").textContent = note;
}
