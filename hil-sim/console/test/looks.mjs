// What the console looks like: every panel at every width, light and dark; its plots under a mouse.
import assert from "node:assert/strict";
import { join } from "node:path";
import { pause } from "./browser.mjs";
import { flaws } from "./sight.mjs";
import { MODE, arm, text } from "./vehicle.mjs";

const WIDTHS = [["desktop", 1400, 900], ["phone", 390, 844], ["small-phone", 320, 640]];
// The colours that draw.
const COLOURS = ["--c1", "--c2", "--c3", "--c4", "--c5", "--c6", "--mass", "--ground", "--force", "--accent", "--problem", "--warn", "--good", "--stop"];
const IN_SIGHT = `(() => { const b = document.getElementById("stop").getBoundingClientRect();
  return document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2).closest("#stop") !== null; })()`;
// The message for a WebSocket at which nobody answers.
const LONG = "nobody answers at ws://127.0.0.1:5761/: does `cargo run -- serve --websocket 127.0.0.1:5761` run?";

/** Every panel open and full, while the vehicle drives, then with a fault. */
export async function views(open, pictures) {
  const page = await open();
  const look = async (state, parts) => {
    for (const [name, width, height] of WIDTHS) {
      await page.resize({ width, height });
      for (const dark of [false, true]) {
        await page.shade(dark);
        // The panels are renewed ten times a second.
        await page.settle();
        await pause(120);
        const where = `${name}, ${dark ? "dark" : "light"}, ${state}`;
        assert.deepEqual(await flaws(page, COLOURS), [], where);
        // Whatever is scrolled to, the button to stop is there.
        for (const part of parts) {
          await page.value(`document.getElementById("${part}").scrollIntoView({ block: "start" })`);
          assert.ok(await page.value(IN_SIGHT), `${where}, ${part}: the button to stop is in sight`);
          await pause(part === "plots" ? 150 : 0);
          await page.settle();
          await page.picture(join(pictures, `${name}-${dark ? "dark" : "light"}-${state}-${part}.png`));
        }
      }
    }
  };
  await arm(page);
  // Panels that this way and state do not show are looked at too.
  await page.value(`(() => {
    document.getElementById("connection").open = true;
    document.getElementById("connection-error").textContent = ${JSON.stringify(LONG)};
    document.getElementById("connection-error").hidden = false;
    document.getElementById("replay-bar").hidden = false;
    document.getElementById("replay-note").textContent = "a-record-with-a-long-name.records: 12000 ticks; every actuation is the recorded one, bit for bit";
  })()`);
  await page.key("keyDown", "ArrowUp");
  await page.key("keyDown", "ArrowLeft");
  await pause(1500);
  await look("drives", ["from-the-right", "plots", "world", "parameters", "replay-bar"]);
  await page.key("keyUp", "ArrowUp");
  await page.key("keyUp", "ArrowLeft");
  await page.click("break-sensor");
  await page.until(`${MODE} === "disarmed" && ${text("faults")}.includes("ImuStale")`);
  await look("fault", ["reasons"]);
}

/** The plots under a mouse: one cursor; a drag holds and zooms them; a double click shows all. */
export async function plots(open) {
  const page = await open();
  await page.until("console_.history.times.length > 150");
  const at = (share) => page.place(".plot .u-over", [share, 0.5]);
  await page.mouse("mouseMoved", await at(0.6));
  await page.until(`(() => { const seen = [...document.querySelectorAll(".plot .u-cursor-x:not(.u-off)")].map((e) => e.style.transform); return seen.length > 2 && new Set(seen).size === 1; })()`);
  const legend = `document.querySelector(".plot .u-legend .u-value").textContent`;
  const span = async () => {
    await page.mouse("mouseMoved", await at(0.05));
    await page.until(`${legend} !== "–"`);
    const first = Number.parseFloat(await page.value(legend));
    await page.mouse("mouseMoved", await at(0.95));
    await page.until(`Number.parseFloat(${legend}) > ${first}`);
    return Number.parseFloat(await page.value(legend)) - first;
  };
  const pressed = `document.getElementById("hold").ariaPressed`;
  assert.equal(await page.value(pressed), "false");
  await page.drag(await at(0.3), await at(0.6), 10);
  await page.until(`${pressed} === "true"`, 10);
  const zoomed = await span();
  await pause(300);
  assert.ok(Math.abs((await span()) - zoomed) < 0.1 * zoomed, "what is zoomed stays so");
  await page.clickAt(await at(0.5), 2);
  await page.until(`!document.querySelector(".plot .u-select").offsetWidth`);
  const whole = await span();
  assert.ok(Math.abs(zoomed - 0.3 * whole) < 0.05 * whole, `${zoomed} s of ${whole} s`);
  // Live again.
  await page.click("hold");
  const last = await page.value("console_.history.times.at(-1)");
  await page.mouse("mouseMoved", await at(0.99));
  await page.until(`Number.parseFloat(${legend}) > ${last}`);
}
