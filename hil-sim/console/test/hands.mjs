// The operator's hands on the console: keys, mouse, fingers, gamepad; and what happens when they let go.
import assert from "node:assert/strict";
import { pause } from "./browser.mjs";
import { COMMAND, MODE, NOTE, READY, SPEED, STANDS, arm, tabTo, text } from "./vehicle.mjs";

const STOPS = `${text("log")}.split("page: stop:").length - 1`;
// The parameters have been read from the board.
const READ = `${text("parameter-state")}.includes("as in force")`;
const FORWARD = `${COMMAND}.speed > 0.1`;
const NEUTRAL = `${COMMAND}.speed === 0 && ${COMMAND}.yaw === 0`;
const CONTROLS = "summary, a[href], button, input, select, textarea, [tabindex='0']";

/** Presses the space bar once, and waits until the page has taken it for a stop. */
async function stopBySpace(page) {
  const before = await page.value(STOPS);
  await page.press("Space");
  await page.until(`${STOPS} === ${before + 1}`, 10);
}

/** Every control by the Tab key in the page's order, each in sight with a mark of the focus. */
export async function keyboard(open) {
  const page = await open();
  await page.until(READY, 120);
  await page.until(READ);
  await tabTo(page, "arm");
  // Opened by the keyboard, and a short list of parameters.
  await page.value("document.querySelector('#connection summary').focus()");
  await page.press("Enter");
  assert.equal(await page.value("document.getElementById('connection').open"), true);
  await page.click("filter");
  await page.send("Input.insertText", { text: "comfort" });
  await page.until("document.querySelectorAll('#parameter-table input').length === 1");
  const order = await page.value(`(() => {
    globalThis.controls_ = [...document.querySelectorAll("${CONTROLS}")].filter((e) => e.checkVisibility() && !e.disabled);
    controls_.forEach((e, n) => (e.dataset.n = n));
    return controls_.map((e) => e.id || e.getAttribute("aria-label") || e.textContent.trim());
  })()`);
  assert.deepEqual(order.slice(0, 3), ["arm", "disarm", "stop"], "what matters most comes first");
  assert.ok(order.length > 40, `${order}`);
  await page.press("Tab");
  await page.value("controls_[0].focus()");
  const seen = async () => page.value(`(() => {
    const e = document.activeElement;
    const style = getComputedStyle(e);
    const b = e.getBoundingClientRect();
    const inSight = [0.1, 0.5, 0.9].some((share) => {
      const found = document.elementFromPoint(b.left + share * b.width, b.top + share * b.height);
      return found !== null && (e.contains(found) || found.contains(e) && !found.closest("#bar"));
    });
    return { n: Number(e.dataset.n), marked: e.matches(":focus-visible") && style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2, inSight };
  })()`);
  for (let n = 0; n < order.length; n += 1) {
    if (n > 0) await page.press("Tab");
    const { n: found, marked, inSight } = await seen();
    assert.equal(found, n, `after ${order[n - 1]} comes ${order[found]}, not ${order[n]}`);
    assert.ok(marked, `the focus on ${order[n]} is marked`);
    assert.ok(inSight, `${order[n]} is in sight when it has the focus`);
  }
  await page.press("Tab", { shift: true });
  assert.equal((await seen()).n, order.length - 2, "and back");
  // A button is pressed by Enter; the space bar stops wherever the focus is.
  await tabTo(page, "hold");
  await page.press("Enter");
  assert.equal(await page.value("document.getElementById('hold').ariaPressed"), "true");
  await stopBySpace(page);
  assert.equal(await page.value("document.getElementById('hold').ariaPressed"), "true");
}

/** The stop in every state, whatever is open and has the focus; and keys that write do not drive. */
export async function stops(open) {
  const page = await open();
  await page.until(READY, 120);
  await page.until(READ);
  const places = ["#connection summary", "#address", "#scenario", "#world-vehicle", "#theme", "#pad", "#speed", "#window", "#push-n", "#filter", "#parameter-table input", "#load", "#record", "#replay", "#log"];
  const through = async (state) => {
    for (const place of places) {
      await page.value(`(() => { document.getElementById("connection").open = true; document.querySelector("${place}").focus(); })()`);
      assert.ok(await page.value(`document.activeElement === document.querySelector("${place}")`), `${place} takes the focus`);
      await stopBySpace(page);
      const sight = await page.value(`(() => { const b = document.getElementById("stop").getBoundingClientRect();
        return document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2)?.closest("#stop") !== null; })()`);
      assert.ok(sight, `${state}, ${place}: the button to stop is in sight`);
    }
    // A remark of the browser at a wrong value lies over the page.
    await page.value(`(() => { const e = document.querySelector("#parameter-table input"); e.setCustomValidity("wrong"); e.reportValidity(); })()`);
    await stopBySpace(page);
    await page.value(`document.querySelector("#parameter-table input").setCustomValidity("")`);
  };
  await through("disarmed");
  await arm(page);
  // One stop brakes, another one within 5 s opens the bridges: in one place after the other, while it drives.
  const one = ["#address", "#parameter-table input"];
  for (const place of one) {
    await page.value("document.activeElement.blur()");
    await page.key("keyDown", "ArrowUp");
    await page.until(`${SPEED} > 0.3`);
    await page.value(`document.querySelector("${place}").focus()`);
    assert.ok(await page.value(NEUTRAL), "a key that is held does not drive on where keys write");
    await page.key("keyUp", "ArrowUp");
    await stopBySpace(page);
    await page.until(STANDS);
    assert.equal(await page.value(MODE), "armed");
    await page.value("console_.operator.stopped = false; document.activeElement.blur()");
    await page.until(`${NOTE}.includes("m/s")`);
  }
  // What is typed into a field is its text, and drives nothing.
  await page.click("filter");
  await page.key("keyDown", "KeyW");
  assert.ok(await page.value(NEUTRAL));
  await page.key("keyUp", "KeyW");
  assert.equal(await page.value("document.getElementById('filter').value"), "w");
  // A slider keeps its arrow keys; letters drive.
  await page.value("document.getElementById('speed').focus()");
  const before = Number(await page.value("document.getElementById('speed').value"));
  await page.key("keyDown", "ArrowRight");
  assert.ok(await page.value(NEUTRAL));
  await page.key("keyUp", "ArrowRight");
  assert.ok(Number(await page.value("document.getElementById('speed').value")) > before);
  await page.key("keyDown", "KeyW");
  assert.ok(await page.value(FORWARD));
  await page.key("keyUp", "KeyW");
  assert.ok(await page.value(NEUTRAL), "a key that is let go drives no more");
  // The browser's menu takes the release of a key, and so does a Mac's Command.
  for (const lost of ["new Event('contextmenu')", "new KeyboardEvent('keyup', { code: 'MetaLeft', key: 'Meta' })"]) {
    await page.key("keyDown", "KeyW");
    assert.ok(await page.value(FORWARD));
    await page.value(`void dispatchEvent(${lost})`);
    assert.ok(await page.value(NEUTRAL), `${lost}: a key whose release is lost drives no more`);
    await page.key("keyUp", "KeyW");
  }
  // Set by the mouse, it gives the arrow keys back.
  await page.clickAt(await page.place("#speed", [0.3, 0.5]));
  await page.key("keyDown", "ArrowUp");
  assert.ok(await page.value(FORWARD));
  // The button to stop, by the mouse, while the key is held: pressed again, the bridges open.
  await page.click("stop");
  await page.until(STANDS);
  assert.equal(await page.value(MODE), "armed");
  await page.click("stop");
  await page.until(`${MODE} === "disarmed"`);
  await page.key("keyUp", "ArrowUp");
}

/** The joystick on the screen under a mouse and under fingers. */
export async function joystick(open, phone) {
  const page = await open(phone);
  await page.send("Emulation.setTouchEmulationEnabled", { enabled: true, maxTouchPoints: 3 });
  await arm(page, async () => page.tap(await page.place("#arm")));
  const centre = await page.place("#pad");
  const up = [centre[0], centre[1] - 50];
  const stop = await page.value("(() => { const b = document.getElementById('stop').getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()");
  const press = async () => {
    await page.touch("touchStart", centre);
    await page.touch("touchMove", up);
    await page.until(`${SPEED} > 0.25`);
  };
  await press();
  await page.touch("touchEnd");
  await page.until(`${NEUTRAL} && ${STANDS}`);
  // A second finger on the joystick takes nothing over, and its leaving nothing away.
  await press();
  const second = [centre[0] + 40, centre[1] + 30];
  await page.touch("touchStart", up, second);
  assert.ok(await page.value(FORWARD));
  await page.lift(1, second);
  assert.ok(await page.value(FORWARD));
  // A touch that the system takes away is a hand that lets go.
  await page.touch("touchCancel");
  await page.until(`${NEUTRAL} && ${STANDS}`);
  // Stopped by another finger; the one on the joystick does not drive on, nor does it when the page comes back.
  await press();
  await page.touch("touchStart", up, stop);
  await page.lift(1, stop);
  await page.until(STANDS);
  assert.equal(await page.value(MODE), "armed");
  assert.match(await page.value(NOTE), /let go of everything/);
  await page.touch("touchEnd");
  await page.until(`${NOTE}.includes("m/s")`);
  await press();
  await page.value("dispatchEvent(new Event('blur'))");
  await page.touch("touchMove", [up[0], up[1] + 5]);
  await page.until(`${NEUTRAL} && ${STANDS}`);
  await page.touch("touchEnd");

  await page.send("Emulation.setTouchEmulationEnabled", { enabled: false });
  // The mouse lets go wherever it is; another button of it does not drive.
  await page.mouse("mouseMoved", centre);
  await page.send("Input.dispatchMouseEvent", { type: "mousePressed", x: up[0], y: up[1], button: "right", buttons: 2, clickCount: 1 });
  assert.ok(await page.value(NEUTRAL));
  await page.send("Input.dispatchMouseEvent", { type: "mouseReleased", x: up[0], y: up[1], button: "right", clickCount: 1 });
  await page.mouse("mousePressed", centre);
  await page.mouse("mouseMoved", [centre[0] - 45, centre[1]], { held: true });
  await page.until("console_.app.status.vehicle.estimate.yaw_rate_rad_s > 0.3");
  await page.mouse("mouseReleased", [20, 20]);
  await page.until(`${NEUTRAL} && Math.abs(console_.app.status.vehicle.estimate.yaw_rate_rad_s) < 0.05`);
}

/**
 * A gamepad. No browser lets a test plug one in: the page's `navigator.getGamepads` is the test's own, and everything from
 * there on is the page's.
 */
export async function gamepad(open) {
  const page = await open({ before: "globalThis.pad_ = null; navigator.getGamepads = () => [null, globalThis.pad_];" });
  const set = (axes, pressed = []) => page.value(`void (globalThis.pad_ = { connected: true, id: "the test's", axes: ${JSON.stringify(axes)}, buttons: Array.from({ length: 17 }, (_, n) => ({ pressed: ${JSON.stringify(pressed)}.includes(n) })) })`);
  await arm(page);
  // Plugged in with its stick pushed: nothing is meant by that.
  await set([0, -0.9]);
  await page.until(`${text("gamepad")} === "the test's"`);
  assert.ok(await page.value(NEUTRAL));
  await set([0.05, 0.08]);
  await page.until("console_.operator.stickFree");
  assert.ok(await page.value(NEUTRAL), "a stick is never quite in its middle");
  const push = async () => {
    await set([0, -0.9]);
    await page.until(`${SPEED} > 0.3`);
  };
  await push();
  await set([0, 0]);
  await page.until(STANDS);
  await set([-0.9, 0]);
  await page.until("console_.app.status.vehicle.estimate.yaw_rate_rad_s > 0.3");
  await set([0, 0]);
  // Unplugged while it drives.
  await push();
  await page.value("void (globalThis.pad_ = null)");
  await page.until(`${NEUTRAL} && ${STANDS}`);
  assert.equal(await page.value(MODE), "armed");
  // The page loses the focus for an instant: the stick that is still pushed is not believed before it has been at rest.
  await set([0, 0]);
  await page.until("console_.operator.stickFree");
  await push();
  await page.value("dispatchEvent(new Event('blur'))");
  await page.until(`${NEUTRAL} && ${STANDS}`);
  await set([0, 0]);
  await page.until("console_.operator.stickFree");
  // Its buttons stop, and again open the bridges; the stick that is held does not drive on.
  for (const button of [0, 1]) {
    await push();
    await set([0, -0.9], [button]);
    await page.until(STANDS);
    assert.equal(await page.value(MODE), "armed");
    await set([0, -0.9]);
    await pause(60);
    if (button === 1) {
      await set([0, -0.9], [button]);
      await page.until(`${MODE} === "disarmed"`);
    }
    await set([0, 0]);
    await page.until("!console_.operator.stopped");
  }
}

/** A page that another one covers is an operator who fell silent. */
export async function hidden(open, browser) {
  const page = await open();
  await arm(page);
  await page.key("keyDown", "ArrowUp");
  await page.until(`${SPEED} > 0.4`);
  await page.send("Emulation.setFocusEmulationEnabled", { enabled: false });
  const other = await browser.page("about:blank", { width: 400, height: 300 });
  await other.send("Page.bringToFront");
  await page.until("document.hidden && !document.hasFocus()", 10);
  assert.equal(await page.value(COMMAND), null, "nobody speaks");
  // A hidden page draws nothing; the board goes on.
  await page.until("console_.app.status.vehicle.mode === 'Disarmed'");
  assert.ok(await page.value(STANDS), "no moving vehicle");
  await other.close();
  await page.send("Page.bringToFront");
  await page.send("Emulation.setFocusEmulationEnabled", { enabled: true });
  await page.until(`${MODE} === "disarmed"`);
  assert.match(await page.value(text("faults")), /CommandTimeout/);
  assert.equal(await page.value("console_.operator.held.size"), 0, "a key that was held before counts no more");
  await page.key("keyUp", "ArrowUp");
}
