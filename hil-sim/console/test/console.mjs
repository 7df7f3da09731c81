// The console in a headless browser, in each of its three ways. `.ci/check-console` builds what it needs and runs it:
//
// node hil-sim/console/test/console.mjs HIL-SIM MODULE.wasm HASH PICTURES
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { copyFileSync, mkdirSync, readdirSync, rmSync } from "node:fs";
import { join, resolve } from "node:path";
import { Browser, until } from "./browser.mjs";
import { gamepad, hidden, joystick, keyboard, stops } from "./hands.mjs";
import { plots, views } from "./looks.mjs";
import { COMMAND, MODE, NOTE, READY, SPEED, STATE, arm, drive, text } from "./vehicle.mjs";

const [tool, module, hash, pictures] = process.argv.slice(2);
const DESKTOP = { width: 1400, height: 900 };
const PHONE = { width: 390, height: 844 };
/** A server of the tool: its address, and what it prints. */
class Server {
  constructor(...args) {
    this.printed = "";
    this.process = spawn(tool, args, { stdio: ["ignore", "pipe", "inherit"] });
    this.process.stdout.on("data", (bytes) => (this.printed += bytes));
  }

  until(pattern) {
    return until(() => this.printed.match(pattern), () => `the server says ${pattern}:\n${this.printed}`);
  }

  end() {
    this.process.kill("SIGTERM");
  }
}

const browser = await Browser.start();
const pages = [];
const consoleServer = new Server("console", "--port", "0", "--module", module);
const [, home] = await consoleServer.until(/console at (\S+)/);

async function open(options = {}) {
  const page = await browser.page(home, { ...DESKTOP, state: STATE, ...options });
  pages.push(page);
  return page;
}

/**
 * Runs a part with a board in real time. On a machine that is too busy for the operator's dead-man time the vehicle
 * stops; then the part runs again with a board that takes longer for its second, and the check says so.
 */
async function inTime(part) {
  for (const rate of ["1", "0.3", "0.1"]) {
    const server = new Server("serve", "--websocket", "127.0.0.1:0", "--rate", rate);
    try {
      const [, address] = await server.until(/board at (ws:\S+)/);
      return await part(server, address);
    } catch (error) {
      if (rate === "0.1" || !server.printed.includes("CommandTimeout")) throw error;
      console.log(`check-console: too busy for ${rate} s a second: ${error.message.split("\n")[0]}`);
      for (const page of pages.splice(0)) await page.close().catch(() => {});
    } finally {
      server.end();
    }
  }
}

async function simulated() {
  const page = await open();
  await arm(page);
  await drive(page);
  assert.ok(await page.value("console_.app.seen.truth.x_m > 0.2"), "the vehicle has driven");

  // The space bar stops, and the vehicle stays armed; keys that are still held do not drive on.
  await page.key("keyDown", "ArrowUp");
  await page.until(`${SPEED} > 0.4`);
  await page.press("Space");
  await page.until(`Math.abs(${SPEED}) < 0.05`);
  assert.equal(await page.value(MODE), "armed");
  // Pressed again: the bridges open.
  await page.press("Space");
  await page.until(`${MODE} === "disarmed"`);
  await page.key("keyUp", "ArrowUp");

  // A page that loses the focus is an operator who fell silent.
  await arm(page);
  await page.key("keyDown", "ArrowUp");
  await page.until(`${SPEED} > 0.4`);
  await page.value("dispatchEvent(new Event('blur')); document.hasFocus = () => false; 0");
  await page.until(`${MODE} === "disarmed"`);
  assert.ok(Math.abs(await page.value(SPEED)) < 0.1, "no moving vehicle");
  await page.value("delete document.hasFocus; 0");
  await page.key("keyUp", "ArrowUp");
  assert.match(await page.value(text("faults")), /CommandTimeout.*keep the page in front/);
  await page.click("clear");

  // Pushed, the armed vehicle moves and holds its place; a dead sensor is a fault with a remedy.
  await arm(page);
  await page.click("push-forward");
  await page.until("console_.app.seen.truth.speed_m_s > 0.05");
  await page.until("Math.abs(console_.app.seen.truth.speed_m_s) < 0.02");
  await page.click("break-sensor");
  await page.until(`${MODE} === "disarmed"`);
  assert.match(await page.value(text("faults")), /ImuStale.*Check the arm IMU/);
  await page.click("mend-sensor");
  await page.until(`!${text("blockers")}.includes("Imu:")`);
  await page.click("clear");
  await page.until(READY);

  assert.equal(await page.value('import("/module.js").then(({ load }) => load("/console.wasm")).then((m) => m.hash("trace_hash"))'), hash,
    "the page's run has the native hash");
}

async function parameters() {
  const page = await open();
  await page.until(`${text("parameter-state")}.includes("as in force")`);
  const edit = (name, value) => page.value(`(() => {
    const input = document.querySelector('[aria-label="${name}"]');
    input.value = "${value}";
    input.dispatchEvent(new Event("change"));
  })()`);
  await edit("control.comfort_s", "77");
  assert.match(await page.value(text("log")), /control.comfort_s = 77: allowed is/);
  await edit("control.comfort_s", "0.3");
  assert.match(await page.value(text("parameter-state")), /1 changed/);
  await page.click("store");
  await page.until(`${text("log")}.includes("the set is stored and in force")`);
  const file = await page.value("console_.app.link.vehicleFile()");
  assert.match(file, /comfort_s = 0\.3\n/);
  // A file is compared with the set in force before anything is stored.
  await page.value(`(() => {
    const files = new DataTransfer();
    files.items.add(new File([${JSON.stringify(file.replace("comfort_s = 0.3", "comfort_s = 0.25"))}], "mine.toml"));
    const input = document.getElementById("load");
    input.files = files.files;
    input.dispatchEvent(new Event("change"));
  })()`);
  await page.until(`${text("log")}.includes("mine.toml: 1 parameters differ")`);
  await page.click("built-in");
  await page.until("/comfort_s = 0\\.2\\n/.test(console_.app.link.vehicleFile())");
}

/**
 * Starts the page's vehicle anew and records it. The board remembers its first ticks for two seconds: a vehicle that
 * takes ten for them waits for the mouse of a busy machine.
 */
async function recordFromBoot(page) {
  const rate = (value) => page.value(`(() => { const rate = document.getElementById("rate"); rate.value = ${value}; rate.dispatchEvent(new Event("change")); })()`);
  await rate(0.2);
  await page.value("(console_.app.status = null, document.getElementById('simulate').requestSubmit())");
  await page.until("console_.app.status !== null");
  await page.click("record");
  assert.equal(await page.value('document.getElementById("record").ariaPressed'), "true");
  await rate(1);
}

async function records() {
  const folder = resolve(pictures, "records");
  rmSync(folder, { recursive: true, force: true });
  await browser.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: folder });
  const saved = () => until(() => found(folder)[0], () => "a saved record");
  const page = await open();
  await recordFromBoot(page);
  await arm(page);
  await drive(page);
  await page.click("record");
  // The host's tool drives the page's records again, bit for bit.
  const replayed = (file) => assert.match(execFileSync(tool, ["replay", file], { encoding: "utf8" }), /every actuation is the recorded one/);
  const file = await saved();
  replayed(file);
  // For the reader of another make, which `.ci/check-console` asks.
  copyFileSync(file, join(pictures, "saved.mcap"));
  const { root } = await page.send("DOM.getDocument");
  const { nodeId } = await page.send("DOM.querySelector", { nodeId: root.nodeId, selector: "#replay" });
  await page.send("DOM.setFileInputFiles", { nodeId, files: [file] });
  await page.until(`${text("replay-note")}.includes("every actuation is the recorded one, bit for bit")`);
  await page.value('(() => { const s = document.getElementById("scrub"); s.value = s.max; s.dispatchEvent(new Event("input")); })()');
  await page.until(`${MODE} === "armed"`);
  // While a record is shown nothing drives the vehicle, the stop stops it, and the page says which is which.
  await page.until(`${NOTE}.includes("the vehicle itself is armed")`);
  await page.key("keyDown", "ArrowUp");
  assert.equal(await page.value(`${COMMAND}.speed`), 0);
  await page.press("Space");
  await page.until(`${text("log")}.includes("stop: the vehicle brakes")`);
  await page.press("Space");
  await page.until(`${NOTE}.includes("the vehicle itself is disarmed")`);
  await page.click("end-replay");
  assert.equal(await page.value(`${COMMAND}.speed`), 0, "a key that was held before counts no more");
  await page.key("keyUp", "ArrowUp");
  // A recording that cannot be made MCAP is saved as its frames, and the page says so.
  rmSync(file);
  await page.value('console_.records.mcap = () => { throw new Error("no room"); }');
  await recordFromBoot(page);
  await page.until(`/^[1-9]/.test(${text("recording")})`);
  await page.click("record");
  const frames = await until(() => found(folder, ".records")[0], () => "the saved frames");
  replayed(frames);
  await page.until(`${text("log")}.includes("could not be made MCAP (no room); it is saved as console.records")`);
  await page.value("delete console_.records.mcap");
  // When the board is lost during a recording, the page keeps what it has received.
  await recordFromBoot(page);
  await page.until(`/^[1-9]/.test(${text("recording")})`);
  await page.value('document.getElementById("connection").open = true');
  await page.click("disconnect");
  replayed(await saved());
  assert.equal(await page.value('document.getElementById("record").ariaPressed'), "false");
}

/** The records that the browser has saved whole: it gives them their name at the end. */
function found(folder, end = ".mcap") {
  try {
    return readdirSync(folder).filter((name) => name.endsWith(end)).map((name) => join(folder, name));
  } catch {
    return [];
  }
}

async function connectTo(page, address) {
  // The page's own simulation is there first.
  await page.until("console_.app.status !== null");
  await page.value('document.getElementById("connection").open = true');
  await page.value(`document.getElementById("address").value = "${address}"`);
  await page.click("socket-connect");
  await page.until(`${text("way")} === "served: connected" && console_.app.status !== null`);
}

async function served(server, address) {
  const first = await open();
  await connectTo(first, address);
  assert.equal(await first.value('document.getElementById("world").checkVisibility()'), false, "nobody pushes a board by a button");
  await arm(first);
  await server.until(/drives/);
  // A second page watches: it sees the vehicle drive, cannot drive it, and can stop it.
  const second = await open();
  await connectTo(second, address);
  await second.until("console_.app.operates === false");
  await drive(first);
  assert.match(await second.value(text("operator")), /watches/);
  assert.equal(await second.value("document.getElementById('arm').getAttribute('aria-disabled')"), "true");
  await second.press("Space");
  await first.until(`${MODE} === "disarmed"`);
  // A page that is closed is an operator who fell silent; the one who watches then takes the wheel.
  await arm(first);
  assert.ok(!server.printed.includes("CommandTimeout"), "the operator was never silent");
  await first.close();
  await server.until(/left, and has driven/);
  await server.until(/CommandTimeout/);
  await second.until(`${MODE} === "disarmed" && ${text("log")}.length > 0`);
  await second.click("wheel");
  await second.until("console_.app.operates === true");
  await second.click("clear");
  await second.until(READY);
}

/** The page's WebSerial with a port that leads to a served board: everything but the browser's own driver. */
async function serial(server, address) {
  const page = await open();
  // The page begins with its own vehicle; what is connected before that would be replaced by it.
  await page.until(`${text("way")} === "simulated: connected"`);
  await page.value(`(async () => {
    const socket = new WebSocket("${address}");
    socket.binaryType = "arraybuffer";
    await new Promise((resolve) => (socket.onopen = resolve));
    const port = {
      open: async ({ baudRate }) => { port.baudRate = baudRate; },
      close: async () => socket.close(),
      writable: new WritableStream({ write: (bytes) => socket.send(bytes) }),
    };
    port.readable = new ReadableStream({ start: (out) => {
      port.pull = () => { port.readable = null; out.error(new Error("the device has been lost")); };
      socket.onmessage = ({ data }) => out.enqueue(new Uint8Array(data));
    } });
    globalThis.port = port;
    await console_.connect("drive board", new console_.SerialTransport({ requestPort: async () => port }, console_.words().link_baud));
  })()`);
  assert.equal(await page.value("port.baudRate"), 921600);
  assert.equal(await page.value('document.getElementById("world").checkVisibility()'), false);
  await arm(page);
  await drive(page);
  assert.ok(!server.printed.includes("CommandTimeout"), "the operator was never silent");
  await page.value("port.pull()");
  await page.until(`${text("connection-error")}.includes("the device has been lost")`);
  await page.until(`${MODE} === "no board"`);
  await server.until(/CommandTimeout/);
}

mkdirSync(pictures, { recursive: true });
let failure;
try {
  const hands = [["keyboard", () => keyboard(open)], ["stops", () => stops(open)], ["joystick", () => joystick(open, PHONE)], ["gamepad", () => gamepad(open)], ["hidden", () => hidden(open, browser)]];
  const looks = [["plots", () => plots(open)], ["views", () => views(open, pictures)]];
  const parts = [...[simulated, parameters, records, served, serial].map((part) => [part.name, part]), ...hands, ...looks];
  const realTime = [served, serial];
  for (const [name, part] of parts.filter(([name]) => !process.env.ONLY || process.env.ONLY.split(",").includes(name))) {
    const begin = Date.now();
    await (realTime.includes(part) ? inTime(part) : part());
    console.log(`check-console: ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`);
    for (const page of pages) assert.deepEqual(page.errors, [], "no errors in the page's console");
    for (const page of pages.splice(0)) await page.close().catch(() => {});
  }
} catch (error) {
  failure = error;
  for (const [n, page] of pages.entries()) {
    console.error(page.errors.join("\n"));
    await page.picture(join(pictures, `failed-${n}.png`)).catch(() => {});
  }
} finally {
  consoleServer.end();
  await browser.close();
}
if (failure) throw failure;
