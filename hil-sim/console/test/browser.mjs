// A headless Chromium over its debugging pipe: opens pages, sends real key, mouse and touch events, takes pictures. No
// package is needed.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const pause = (ms = 50) => new Promise((resolve) => setTimeout(resolve, ms));

/** What `find` finds, as soon as it finds something; an error with what `state` tells otherwise. */
export async function until(find, state, seconds = 60) {
  const end = Date.now() + seconds * 1000;
  while (Date.now() < end) {
    const found = await find();
    if (found) return found;
    await pause();
  }
  throw new Error(`not within ${seconds} s: ${await state()}`);
}

const BROWSERS = ["chromium", "chromium-browser", "google-chrome"];

export class Browser {
  static async start() {
    for (const name of BROWSERS) {
      const browser = new Browser();
      if (await browser.open(name)) return browser;
    }
    throw new Error("no browser");
  }

  async open(name) {
    this.profile = mkdtempSync(join(tmpdir(), "console-"));
    this.next = 1;
    this.waiting = new Map();
    this.listeners = [];
    const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--mute-audio",
      "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-background-timer-throttling",
      "--disable-renderer-backgrounding", "--remote-debugging-pipe", `--user-data-dir=${this.profile}`, "about:blank"];
    this.process = spawn(name, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    const started = await new Promise((resolve) => {
      this.process.once("error", () => resolve(false));
      this.process.once("spawn", () => resolve(true));
    });
    if (!started) return false;
    let rest = "";
    this.process.stdio[3].on("error", () => {});
    this.process.stdio[4].on("data", (bytes) => {
      const messages = (rest + bytes).split("\0");
      rest = messages.pop();
      for (const message of messages) this.take(JSON.parse(message));
    });
    return true;
  }

  take(message) {
    const waiting = this.waiting.get(message.id);
    if (waiting) {
      this.waiting.delete(message.id);
      if (message.error) waiting.reject(new Error(message.error.message));
      else waiting.resolve(message.result);
    } else {
      for (const listener of this.listeners) listener(message);
    }
  }

  send(method, params = {}, sessionId = undefined) {
    const id = this.next++;
    this.process.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  /**
   * Opens a page of this size. `before` is a script that runs before the page's own; `state` is an expression that tells
   * of a page on which something is awaited in vain.
   */
  async page(url, { width, height, dark = false, before = "", state = "document.title" }) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId, targetId, state);
    await page.send("Page.enable");
    await page.send("Runtime.enable");
    await page.send("Log.enable");
    await page.send("Emulation.setFocusEmulationEnabled", { enabled: true });
    await page.resize({ width, height });
    await page.shade(dark);
    if (before) await page.send("Page.addScriptToEvaluateOnNewDocument", { source: before });
    const loaded = new Promise((resolve) => this.listeners.push(({ sessionId: of, method }) => {
      if (of === sessionId && method === "Page.loadEventFired") resolve();
    }));
    const { errorText } = await page.send("Page.navigate", { url });
    if (errorText) throw new Error(`${url}: ${errorText}`);
    await loaded;
    return page;
  }

  async close() {
    await this.send("Browser.close").catch(() => {});
    await new Promise((resolve) => (this.process.exitCode === null ? this.process.once("exit", resolve) : resolve()));
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  }
}

// Number, name and text of each key.
const CODES = {
  Space: [32, " ", " "], Enter: [13, "Enter", "\r"], Tab: [9, "Tab"], Home: [36, "Home"], End: [35, "End"], Escape: [27, "Escape"],
  ArrowUp: [38, "ArrowUp"], ArrowDown: [40, "ArrowDown"], ArrowLeft: [37, "ArrowLeft"], ArrowRight: [39, "ArrowRight"],
  KeyW: [87, "w", "w"],
};
const SHIFT = 8;

class Page {
  constructor(browser, sessionId, targetId, state) {
    this.state = state;
    this.browser = browser;
    this.sessionId = sessionId;
    this.targetId = targetId;
    /** What the page's console shows as errors. */
    this.errors = [];
    browser.listeners.push((message) => {
      if (message.sessionId !== sessionId) return;
      const { method, params } = message;
      if (method === "Runtime.exceptionThrown") this.errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Runtime.consoleAPICalled" && params.type === "error") this.errors.push(params.args.map((each) => each.value ?? each.description).join(" "));
      if (method === "Log.entryAdded" && params.entry.level === "error") this.errors.push(`${params.entry.text} ${params.entry.url ?? ""}`);
    });
  }

  send(method, params) {
    return this.browser.send(method, params, this.sessionId);
  }

  /** The value of an expression; a promise's when it is one. */
  async value(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
    return result.value;
  }

  resize({ width, height }) {
    return this.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 600 });
  }

  shade(dark) {
    return this.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  }

  /** Waits until the page has been drawn twice: what follows from its size or its shade has happened. */
  settle() {
    return this.value("new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => resolve(0))))");
  }

  /** Waits until an expression is true. */
  async until(expression, seconds = 60) {
    await until(() => this.value(expression), async () => `${expression}\n${await this.value(this.state)}`, seconds);
  }

  key(type, code, modifiers = 0) {
    const [windowsVirtualKeyCode, key, text] = CODES[code];
    return this.send("Input.dispatchKeyEvent", { type, code, key, windowsVirtualKeyCode, modifiers, text: type === "keyDown" ? text : undefined });
  }

  async press(code, { shift = false } = {}) {
    await this.key("keyDown", code, shift ? SHIFT : 0);
    await this.key("keyUp", code, shift ? SHIFT : 0);
  }

  /** A mouse event; the left button is held while the mouse is dragged. */
  mouse(type, [x, y], { held = false, clicks = 1 } = {}) {
    const button = type === "mouseMoved" && !held ? "none" : "left";
    return this.send("Input.dispatchMouseEvent", { type, x, y, button, buttons: type === "mousePressed" || held ? 1 : 0, clickCount: type === "mouseMoved" ? 0 : clicks });
  }

  async clickAt(place, clicks = 1) {
    await this.mouse("mousePressed", place, { clicks });
    await this.mouse("mouseReleased", place, { clicks });
  }

  /** Drags the mouse from one place to another in steps. */
  async drag(from, to, steps = 6) {
    await this.mouse("mouseMoved", from);
    await this.mouse("mousePressed", from);
    for (let n = 1; n <= steps; n += 1) {
      await this.mouse("mouseMoved", [0, 1].map((axis) => from[axis] + ((to[axis] - from[axis]) * n) / steps), { held: true });
      await pause(20);
    }
    await this.mouse("mouseReleased", to);
  }

  /** A touch event: touchStart or touchMove with the fingers that touch from then on; touchEnd or touchCancel of them all. */
  touch(type, ...fingers) {
    return this.send("Input.dispatchTouchEvent", { type, touchPoints: fingers.map(([x, y], id) => ({ x, y, id })) });
  }

  /** Lifts one of several fingers, by its number. */
  lift(id, [x, y]) {
    return this.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [{ x, y, id }] });
  }

  async tap(place) {
    await this.touch("touchStart", place);
    await this.touch("touchEnd");
  }

  /** An element's box in the window, in whose middle it is scrolled: left, top, width, height. */
  async box(selector) {
    return this.value(`(() => {
      const e = document.querySelector(${JSON.stringify(selector)});
      e.scrollIntoView({ block: "center", behavior: "instant" });
      const b = e.getBoundingClientRect();
      return [b.left, b.top, b.width, b.height];
    })()`);
  }

  /** The place at these shares of an element's width and height. */
  async place(selector, [across, down] = [0.5, 0.5]) {
    const [left, top, width, height] = await this.box(selector);
    return [left + across * width, top + down * height];
  }

  /**
   * Clicks in the middle of an element, with the mouse, once it is enabled, stands still and lies on top. A page that is
   * being filled may move it away before the mouse comes down; then the click is made again.
   */
  async click(id) {
    for (let n = 0; n < 20; n += 1) {
      await this.until(`!document.getElementById("${id}").disabled`);
      const place = await this.value(`(async () => {
        const e = document.getElementById("${id}");
        e.scrollIntoView({ block: "center" });
        const middle = () => { const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; };
        const before = middle();
        await new Promise((resolve) => setTimeout(resolve, 50));
        const now = middle();
        if (String(before) !== String(now) || !e.contains(document.elementFromPoint(...now))) return null;
        globalThis.clicked_ = false;
        e.addEventListener("click", () => (globalThis.clicked_ = true), { once: true });
        return now;
      })()`);
      if (place) {
        const [x, y] = place;
        for (const type of ["mousePressed", "mouseReleased"]) await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
        if (await this.value("clicked_")) return;
      }
      await pause();
    }
    throw new Error(`no click reaches ${id}`);
  }

  /** Writes a picture of the window, or of the whole page. */
  async picture(file, whole = false) {
    const { data } = await this.send("Page.captureScreenshot", { format: "png", captureBeyondViewport: whole });
    writeFileSync(file, Buffer.from(data, "base64"));
  }

  async close() {
    await this.browser.send("Target.closeTarget", { targetId: this.targetId });
  }
}
