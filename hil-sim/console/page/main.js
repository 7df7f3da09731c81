// The page: joins the ways to a board, the operator, the views.
import { Link } from "./link.js";
import { load } from "./module.js";
import { Operator } from "./operator.js";
import { log, modeWord, showMode, showQuality, showState, showTerms, tell } from "./panels.js";
import { Parameters } from "./parameters.js";
import { History, Plots } from "./plots.js";
import { Records } from "./records.js";
import { SerialTransport, SimulatedTransport, SocketTransport } from "./transports.js";
import { SideView, TopView, fixed, geometryOf } from "./view.js";
import { World } from "./world.js";

const WASM = new URL("console.wasm", location.href).href;
// Without a status for so long the board counts as silent, ms.
const SILENT_MS = 500;
// Between two drawings of the views, and of plots and panels, ms.
const VIEWS_MS = 30;
const PLOTS_MS = 100;

const element = (id) => document.getElementById(id);

const app = {
  link: null, transport: null, way: "", status: null, host: null, heardMs: 0, rateHz: 0, statuses: 0, operates: false,
  seen: null, parametersRead: 0, mode: "none", connecting: Promise.resolve(),
};
const history = new History();
const side = new SideView(element("side"));
const top_ = new TopView(element("top"));
const parameters = new Parameters();
const operator = new Operator(
  { pad: element("pad"), knob: element("knob"), speed: element("speed"), yaw: element("yaw") },
  stop,
);
let geometry;
let plots;
let words;
const records = new Records({
  link: () => app.link,
  vehicleFile: () => app.link?.vehicleFile() ?? "",
  show: (status) => draw(status, null),
  row: rowOf,
  away: (on) => {
    operator.letGo();
    operator.away = on;
  },
});
const world = new World(() => (app.transport instanceof SimulatedTransport ? app.transport : null));

/** Module instances of their own: the link's, and one for replays and words. */
async function begin() {
  const module = await load(WASM);
  words = module.json("vocabulary");
  records.module = module;
  for (const name of words.scenarios) element("scenario").append(new Option(name, name));
  world.offer(words.sensor_faults);
  geometry = { radius: 0.25, arm: 0.2, halfTrack: 0.25, spar: 0.25, motor: 0.0417, ballast: 0.0417 };
  plots = new Plots(element("plots"), () => element("hold").setAttribute("aria-pressed", "true"));
  if (!("serial" in navigator)) {
    element("serial-note").textContent = "This browser has no WebSerial; Chrome and Edge on a computer have it.";
    element("serial").querySelector("button").hidden = true;
  }
  await connect("simulated", new SimulatedTransport({}, WASM));
  requestAnimationFrame(frame);
}

/** Connects over a transport, after whatever is being connected; what was connected before is closed. */
function connect(way, transport) {
  app.connecting = app.connecting.then(() => connectNow(way, transport));
  return app.connecting;
}

async function connectNow(way, transport) {
  element("connection-error").hidden = true;
  try {
    await disconnect();
    await transport.open();
    const module = await load(WASM);
    app.transport = transport;
    app.way = way;
    transport.onclose = (reason) => lost(transport, reason);
    if (transport instanceof SimulatedTransport) {
      transport.onseen = (seen) => {
        app.seen = seen;
        log(seen.log.map((line) => `board: ${line}`));
      };
      transport.onrefused = tell;
    }
    app.link = new Link(module, transport, () => operator.command(), 1000 * words.command_period_ms);
    app.link.onheard = heard;
    takeTheWheel();
    element("way").textContent = `${way}: connected`;
    element("vehicle").textContent = { simulated: `simulated in this page, ${transport.world?.scenario || "level ground"}`, served: `served at ${transport.url}`, "drive board": "the drive board at its serial port" }[way];
    element("connection").open = false;
    element("disconnect").hidden = false;
    world.show(transport instanceof SimulatedTransport);
    for (const form of ["simulate", "socket", "serial"]) element(form).removeAttribute("aria-current");
    element({ simulated: "simulate", served: "socket", "drive board": "serial" }[way]).setAttribute("aria-current", "true");
  } catch (error) {
    element("connection-error").textContent = error.message;
    element("connection-error").hidden = false;
    element("connection").open = true;
    await transport.close().catch(() => {});
  }
}

async function disconnect() {
  const { link } = app;
  operator.speaks = false;
  Object.assign(app, { link: null, transport: null, status: null, host: null, seen: null, statuses: 0, parametersRead: 0 });
  records.stopped(link);
  if (link) await link.close();
  history.clear();
  top_.forget();
  parameters.forget();
  world.show(false);
  element("way").textContent = "not connected";
  element("board").textContent = "";
  element("vehicle").textContent = "none";
  element("disconnect").hidden = true;
}

function lost(transport, reason) {
  if (app.transport !== transport) return;
  element("connection-error").textContent = reason;
  element("connection-error").hidden = false;
  element("connection").open = true;
  disconnect();
}

/** Gives orders from now on; the operator begins neutral. */
function takeTheWheel() {
  operator.letGo();
  operator.speaks = true;
  app.link.operate(true);
}

/** A first press stops the vehicle; a second one before it drives on, or one without the wheel, opens the bridges. */
function stop() {
  if (!app.link) return;
  const now = performance.now();
  const armed = app.status?.vehicle.mode === "Armed";
  if (!armed || !app.operates || (stop.pressed && !operator.drivenOn && now - stop.pressed < 5000)) {
    app.link.disarm();
    tell("stop: the bridges are told to open");
    stop.pressed = 0;
  } else {
    tell("stop: the vehicle brakes and holds its place; press again to open the bridges");
    stop.pressed = now;
  }
}

/** Takes what the link has heard. */
function heard(news) {
  news.told.forEach(tell);
  log(news.log.map((line) => (app.transport instanceof SimulatedTransport ? "" : `board: ${line}`)).filter(Boolean));
  app.host = news.quality;
  app.operates = news.operates;
  operator.speaks = news.operates;
  if (news.foreign != null && !news.board)
    element("board").textContent = `the board speaks protocol ${news.foreign}, this page ${words.protocol}: build both from one tree`;
  else if (news.board) element("board").textContent = news.board;
  parameters.progress(news.parameter_work);
  if (news.parameters_read !== app.parametersRead) {
    app.parametersRead = news.parameters_read;
    parameters.take(app.link);
    useParameters(parameters.rows);
  }
  records.counted(news.recording);
  for (const status of news.statuses) {
    app.status = status;
    app.heardMs = performance.now();
    app.statuses += 1;
    const command = operator.command();
    history.push(status.vehicle.time_us * 1e-6, rowOf(status.vehicle, app.seen?.truth, command));
    const { estimate } = status.vehicle;
    top_.add([estimate.x_m, estimate.y_m], app.seen ? [app.seen.truth.x_m, app.seen.truth.y_m] : null);
  }
}

function useParameters(rows) {
  geometry = geometryOf(rows);
  const value = (name) => rows.find((row) => row.table === "control" && row.name === name)?.value;
  element("speed").max = value("speed_max_m_s") ?? 1;
  element("yaw").max = value("yaw_rate_max_rad_s") ?? 1;
  showSpeeds();
}

/** One row of the history. */
function rowOf(vehicle, truth, command) {
  const degrees = (rad) => (rad * 180) / Math.PI;
  const e = vehicle.estimate;
  return {
    commanded_speed: command?.speed, reference_speed: vehicle.speed_reference_m_s, speed: e.speed_m_s, true_speed: truth?.speed_m_s,
    phi: degrees(e.phi_rad), true_phi: truth && degrees(truth.phi_rad), spar: degrees(e.spar_rad), slope: degrees(e.slope_rad),
    commanded_yaw: command?.yaw, reference_yaw: vehicle.yaw_rate_reference_rad_s, yaw: e.yaw_rate_rad_s, true_yaw: truth?.yaw_rate_rad_s,
    voltage_left: vehicle.voltage_v[0], voltage_right: vehicle.voltage_v[1], voltage_ballast: vehicle.voltage_v[2], battery: vehicle.battery_v,
    current_left: vehicle.current_a[0], current_right: vehicle.current_a[1], current_ballast: vehicle.current_a[2],
    slip_left: truth?.slip_m_s[0], slip_right: truth?.slip_m_s[1],
  };
}

/** What the views draw of a status, and of what is true beside it. */
function poseOf(vehicle, seen) {
  const e = vehicle.estimate;
  const truth = seen?.truth;
  return {
    phi: truth?.phi_rad ?? e.phi_rad, spar: truth?.spar_rad ?? e.spar_rad, ballast: truth?.ballast_rad ?? e.ballast_rad,
    slope: truth?.slope_rad ?? e.slope_rad, plane: seen?.plane_rad ?? e.slope_rad, distance: e.distance_m,
    speed: truth?.speed_m_s ?? e.speed_m_s, sliding: e.sliding, heading: e.heading_rad, x: e.x_m, y: e.y_m,
    truth, ground: seen?.ground_m, spacing: seen?.ground_spacing_m, height: truth?.height_m,
  };
}

function draw(vehicle, seen) {
  const pose = poseOf(vehicle, seen);
  side.draw(geometry, pose);
  top_.draw(geometry, pose);
}

let panelsMs = 0;
let drawnMs = 0;
let rateFrom = { ms: 0, statuses: 0 };

function frame(ms) {
  requestAnimationFrame(frame);
  const { status } = app;
  if (!records.replaying && status && ms - drawnMs >= VIEWS_MS) {
    draw(status.vehicle, app.seen);
    drawnMs = ms;
  }
  if (ms - panelsMs < PLOTS_MS) return;
  panelsMs = ms;
  if (ms - rateFrom.ms > 1000) {
    app.rateHz = ((app.statuses - rateFrom.statuses) * 1000) / (ms - rateFrom.ms);
    rateFrom = { ms, statuses: app.statuses };
  }
  showPanels(ms);
  if (records.replaying) {
    if (records.dirty) plots.draw(records.history, 0);
    records.dirty = false;
  } else if (element("hold").getAttribute("aria-pressed") !== "true" && history.times.length) {
    plots.draw(history, history.place(history.times.at(-1) - Number(element("window").value)));
  }
}

function showPanels(ms) {
  const { status } = app;
  const age = Math.max(0, ms - app.heardMs);
  const silent = status && age > SILENT_MS;
  app.mode = records.replaying ? records.mode : !app.link ? "none" : !status ? "none" : silent ? "silent" : status.vehicle.mode;
  showMode(app.mode, note(silent));
  const live = Boolean(status) && !silent && app.operates;
  const pending = document.activeElement;
  for (const [id, on] of [["arm", live && !records.replaying && status.vehicle.mode === "Disarmed"], ["disarm", Boolean(app.link)], ["clear", live && status.vehicle.faults !== 0]]) {
    // A button that has the focus keeps it: a keyboard's user is not thrown to the top of the page.
    element(id).disabled = !on && pending !== element(id);
    element(id).setAttribute("aria-disabled", !on);
  }
  element("wheel").hidden = !app.link || app.operates || !status;
  element("operator").textContent = !app.link ? "" : !app.operates ? "This page watches; another operator may drive."
    : operator.present() ? "This page drives." : "Silent: this page is not in front. An armed vehicle makes a controlled stop.";
  element("gamepad").textContent = operator.gamepadName ?? "none";
  if (!status || records.replaying) return;
  showState(words, status.vehicle, app.seen?.truth);
  showTerms(status.vehicle.terms, status.vehicle.battery_v);
  showQuality(status, app.host, app.rateHz, age);
}

function note(silent) {
  const { status } = app;
  if (records.replaying) {
    const vehicle = !app.link ? "no vehicle is connected" : !status ? "the vehicle says nothing" : silent ? "the board is silent" : `the vehicle itself is ${modeWord(status.vehicle.mode)}`;
    return `a record is shown: nothing drives but the stop stops; ${vehicle}`;
  }
  if (!app.link) return "connect a vehicle above";
  if (!status) return app.operates ? "the board has not said who it is yet" : "";
  if (silent) return "no status from the board";
  const name = (codes, bits) => codes.filter((code) => bits & (1 << code.number)).map((code) => code.name).join(", ");
  const { vehicle } = status;
  if (vehicle.faults) return `faults: ${name(words.faults, vehicle.faults)}`;
  if (vehicle.mode === "Armed" && !operator.present()) return "this page is not in front: controlled stop";
  if (vehicle.mode === "Armed" && operator.stopped) return "stopped: let go of everything to drive on";
  if (vehicle.mode === "Armed") return `${fixed(vehicle.estimate.speed_m_s, 2)} m/s`;
  if (vehicle.blockers) return `cannot be armed: ${name(words.blockers, vehicle.blockers)}`;
  return "ready to be armed";
}

function showSpeeds() {
  element("speed-out").textContent = `${Number(element("speed").value).toFixed(1)} m/s`;
  element("yaw-out").textContent = `${Number(element("yaw").value).toFixed(1)} rad/s`;
}

function listen() {
  const able = (id, act) => element(id).addEventListener("click", () => {
    if (app.link && element(id).getAttribute("aria-disabled") !== "true") act();
  });
  able("arm", () => app.link.arm());
  able("disarm", () => app.link.disarm());
  able("clear", () => app.link.clearFaults());
  // As soon as it is touched: a browser makes no click of a finger's tap while another finger holds the joystick. What
  // clicks without a pointer is the keyboard, or what stands for it.
  element("stop").addEventListener("pointerdown", () => operator.stop());
  element("stop").addEventListener("click", ({ detail }) => {
    if (detail === 0) operator.stop();
  });
  element("wheel").addEventListener("click", takeTheWheel);
  element("disconnect").addEventListener("click", disconnect);
  for (const id of ["speed", "yaw"]) element(id).addEventListener("input", showSpeeds);
  element("rate").addEventListener("change", ({ target }) => app.transport?.setRate?.(Number(target.value)));
  element("hold").addEventListener("click", ({ target }) =>
    target.setAttribute("aria-pressed", target.getAttribute("aria-pressed") !== "true"));
  const submitted = (id, act) => element(id).addEventListener("submit", (event) => {
    event.preventDefault();
    act();
  });
  submitted("simulate", async () => {
    const file = element("world-vehicle").files[0];
    const asked = { scenario: element("scenario").value, vehicle: file ? await file.text() : "" };
    const transport = new SimulatedTransport(asked, WASM);
    await connect("simulated", transport);
    if (app.transport === transport) transport.setRate(Number(element("rate").value));
  });
  submitted("socket", () => {
    try {
      connect("served", new SocketTransport(new URL(element("address").value).href));
    } catch (error) {
      tell(`no address: ${error.message}`);
    }
  });
  submitted("serial", () => connect("drive board", new SerialTransport(navigator.serial, words.link_baud)));
  theme();
  // A page that is left says so; a vehicle whose operator falls silent stops by itself.
  addEventListener("pagehide", () => app.link?.transport.close());
}

function theme() {
  const kept = localStorage.getItem("theme") ?? "";
  const choices = [["", "as the system"], ["light", "light"], ["dark", "dark"]];
  const use = (name) => {
    if (name) document.documentElement.dataset.theme = name;
    else delete document.documentElement.dataset.theme;
    element("theme").textContent = `Theme: ${choices.find(([each]) => each === name)?.[1] ?? choices[0][1]}`;
    localStorage.setItem("theme", name);
    plots?.build();
    records.dirty = true;
  };
  use(kept);
  element("theme").addEventListener("click", () => {
    const now = choices.findIndex(([each]) => each === (document.documentElement.dataset.theme ?? ""));
    use(choices[(now + 1) % choices.length][0]);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots?.build());
}

// For tests and for the curious: what the page knows, and its ways.
globalThis.console_ = { app, operator, records, history, connect, SerialTransport, words: () => words };

listen();
showSpeeds();
begin().catch((error) => {
  element("connection-error").textContent = `the page cannot start: ${error.message}`;
  element("connection-error").hidden = false;
});
