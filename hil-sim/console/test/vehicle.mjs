// What the tests of the console do with its vehicle: read the page, arm, drive.
import assert from "node:assert/strict";

export const text = (id) => `document.getElementById("${id}").textContent`;
export const MODE = text("mode-word");
export const NOTE = text("bar-note");
export const READY = `${NOTE} === "ready to be armed"`;
export const SPEED = "console_.app.status.vehicle.estimate.speed_m_s";
export const STANDS = `Math.abs(${SPEED}) < 0.05`;
/** What the page tells the vehicle now. */
export const COMMAND = "console_.operator.command()";
/** What the page looks like when something is awaited in vain. */
export const STATE = `[${["mode", "bar-note", "connection-error", "log"].map(text).join(", ")}].join('\\n')`;

/** Moves the focus by the Tab key until an element has it. */
export async function tabTo(page, id) {
  for (let n = 0; n < 200; n += 1) {
    if (await page.value(`document.activeElement.id === "${id}"`)) return;
    await page.press("Tab");
  }
  throw new Error(`the Tab key does not reach ${id}`);
}

/**
 * Arms by the keyboard, or by `press`; again where the vehicle, which still rocked after a drive, was not at rest in that
 * instant.
 */
export async function arm(page, press = byKeyboard) {
  const refusals = `${text("log")}.split("not armed: blocked by NotAtRest").length`;
  for (let n = 0; n < 10; n += 1) {
    await page.until(READY, 120);
    const before = await page.value(refusals);
    await press(page);
    await page.until(`${MODE} === "armed" || ${refusals} > ${before}`);
    if (await page.value(`${MODE} === "armed"`)) return;
  }
  throw new Error("the vehicle does not come to rest");
}

async function byKeyboard(page) {
  await tabTo(page, "arm");
  assert.ok(await page.value("document.activeElement.matches(':focus-visible')"), "the focus is visible");
  await page.press("Enter");
}

/** Drives by a held key, and lets go. */
export async function drive(page) {
  await page.key("keyDown", "ArrowUp");
  await page.until(`${SPEED} > 0.4`);
  await page.key("keyUp", "ArrowUp");
  await page.until(STANDS);
}
