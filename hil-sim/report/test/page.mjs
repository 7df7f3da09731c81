// Pages that the tool has written, in a headless browser as a person uses them. `.ci/check-page` runs it:
//
// node hil-sim/report/test/page.mjs PICTURES PAGE.html...
import assert from "node:assert/strict";
import { mkdirSync, statSync } from "node:fs";
import { basename, dirname, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser, pause } from "../../console/test/browser.mjs";
import { flaws } from "../../console/test/sight.mjs";

const [pictures, ...files] = process.argv.slice(2);
const SIZES = [[390, 844], [320, 700], [1400, 900]];
// The colours that draw.
const COLOURS = ["--true", "--estimated", "--commanded", "--reference", ...Array.from({ length: 9 }, (_, n) => `--c${n}`), "--ground", "--mass", "--problem", "--good", "--note"];
// Less than this is an empty picture, bytes.
const PICTURE_MIN = 10_000;

const NOW = `Number.parseFloat(document.getElementById("now").textContent)`;
// The range of time that the first chart shows, from the marks at its axis; and the places of the cursors of all charts.
const LENGTH = "(() => { const [a, b] = document.getElementById('strip').dataset.range.split(' ').map(Number); return b - a; })()";
const CURSORS = `[...document.querySelectorAll(".u-cursor-x")].map((e) => e.style.transform)`;
const LEGENDS = `[...document.querySelectorAll(".u-legend tr:first-child .u-value")].map((e) => e.textContent)`;
const SCENE = `document.getElementById("side").toDataURL() + document.getElementById("above").toDataURL()`;
const CHART = "[data-chart='0'] .u-over";

/** What a person does with the page of a run. */
async function use(page) {
  const whole = await page.value(LENGTH);
  const near = (a, b, tolerance) => assert.ok(Math.abs(a - b) <= tolerance, `${a}, not ${b}`);

  // The mouse over a chart: the cursor of every chart, the slider, the views and the strip go where it is.
  await page.mouse("mouseMoved", await page.place(CHART, [0.25, 0.5]));
  await page.settle();
  const [early, scene] = [await page.value(NOW), await page.value(SCENE)];
  await page.mouse("mouseMoved", await page.place(CHART, [0.75, 0.5]));
  await page.until(`${NOW} > ${early}`);
  near(await page.value(NOW), early + 0.5 * whole, 0.02 * whole);
  const cursors = await page.value(CURSORS);
  assert.ok(cursors.length > 3 && new Set(cursors).size === 1, `one cursor: ${cursors}`);
  const legends = await page.value(LEGENDS);
  assert.equal(new Set(legends).size, 1, `one time: ${legends}`);
  assert.notEqual(legends[0], "–");
  assert.notEqual(await page.value(SCENE), scene, "the vehicle moves with the cursor");
  near(await page.value("Number.parseFloat(document.querySelector('#strip .cursor b').style.left)"), 75, 3);

  // A drag over a chart zooms all of them and the strip; a double click shows the whole run again, and so does the button.
  const axes = "[...document.querySelectorAll('[data-chart] canvas')].map((e) => e.toDataURL())";
  const before = await page.value(axes);
  for (const reset of ["double click", "button"]) {
    await page.drag(await page.place(CHART, [0.3, 0.4]), await page.place(CHART, [0.6, 0.6]));
    await page.until(`Math.abs(${LENGTH} - ${0.3 * whole}) < ${0.03 * whole}`);
    await page.settle();
    const zoomed = await page.value(axes);
    assert.ok(zoomed.every((chart, n) => chart !== before[n]), "every chart is zoomed");
    if (reset === "button") await page.click("whole");
    else await page.clickAt(await page.place(CHART), 2);
    await page.until(`Math.abs(${LENGTH} - ${whole}) < ${0.01 * whole}`);
  }

  // The slider by the keyboard and by the mouse.
  await page.value("document.getElementById('time').focus()");
  await page.press("Home");
  await page.until(`${NOW} < ${0.01 * whole}`);
  for (let n = 0; n < 5; n += 1) await page.press("ArrowRight");
  const stepped = await page.value(NOW);
  near(await page.value("document.getElementById('time').value"), 5, 0);
  await page.clickAt(await page.place("#time"));
  await page.until(`Math.abs(${NOW} - ${0.5 * whole}) < ${0.03 * whole}`);
  assert.ok(stepped < (await page.value(NOW)));

  // Zoomed by the keyboard around the cursor, and out again.
  await page.value("document.getElementById('closer').focus()");
  await page.press("Enter");
  await page.press("Space");
  await page.until(`Math.abs(${LENGTH} - ${0.25 * whole}) < ${0.02 * whole}`);
  await page.picture(join(pictures, "zoomed.png"));
  await page.press("Tab");
  assert.ok(await page.value("document.activeElement.id === 'wider' && document.activeElement.matches(':focus-visible')"), "the next control, in sight");
  await page.press("Enter");
  await page.press("Enter");
  await page.press("Enter");
  await page.until(`Math.abs(${LENGTH} - ${whole}) < ${0.01 * whole}`);

  // What happened: each time leads there.
  const at = await page.value("(() => { const all = [...document.querySelectorAll('button[data-at]')]; all.at(-1).id = 'last-event'; return Number(all.at(-1).dataset.at); })()");
  await page.click("last-event");
  await page.until(`Math.abs(${NOW} - ${at}) < 0.02`);
  assert.ok(await page.value("document.querySelectorAll('#strip .lane i').length > 0"), "a strip of what happened");

  // Played, in real time, and paused.
  await page.press("Home");
  await page.value("document.getElementById('time').focus()");
  await page.press("Home");
  await page.click("play");
  const begin = Date.now();
  await page.until(`${NOW} > 0.5`, 10);
  const took = (Date.now() - begin) / 1000;
  assert.ok(took > 0.3, `half a second took ${took} s`);
  await page.press("Enter");
  assert.equal(await page.value("document.getElementById('play').textContent"), "Play");
  const paused = await page.value(NOW);
  await pause(150);
  assert.equal(await page.value(NOW), paused, "it stands still");
}

/** The same page under a finger. */
async function touch(page) {
  await page.send("Emulation.setTouchEmulationEnabled", { enabled: true });
  const whole = await page.value(LENGTH);
  await page.tap(await page.place(CHART, [0.5, 0.5]));
  await page.until(`Math.abs(${NOW} - ${0.5 * whole}) < ${0.05 * whole}`);
  assert.equal(new Set(await page.value(CURSORS)).size, 1, "one cursor");
  await page.tap(await page.place("#closer"));
  await page.until(`Math.abs(${LENGTH} - ${0.5 * whole}) < ${0.02 * whole}`);
  await page.tap(await page.place("#whole"));
  await page.until(`Math.abs(${LENGTH} - ${whole}) < ${0.01 * whole}`);
  const [from, to] = [await page.place("#time", [0.5, 0.5]), await page.place("#time", [0.8, 0.5])];
  await page.touch("touchStart", from);
  await page.touch("touchMove", to);
  await page.touch("touchEnd");
  await page.until(`Math.abs(${NOW} - ${0.8 * whole}) < ${0.06 * whole}`);
}

async function check(browser, file) {
  const page = await browser.page(pathToFileURL(resolve(file)).href, { width: SIZES[0][0], height: SIZES[0][1] });
  const name = basename(file) === "index.html" ? basename(dirname(resolve(file))) : basename(file, ".html");
  // An interactive page tells how many charts its script has drawn: every one that it holds.
  const interactive = await page.value("document.getElementById('data') !== null");
  if (interactive) await page.until("Number(document.documentElement.dataset.drawn) === document.querySelectorAll('[data-chart]').length", 10);
  for (const [width, height] of SIZES) {
    await page.resize({ width, height });
    for (const dark of [false, true]) {
      await page.shade(dark);
      await page.settle();
      assert.deepEqual(await flaws(page, interactive ? COLOURS : []), [], `${name} at ${width} px, ${dark ? "dark" : "light"}`);
      const picture = join(pictures, `${name}-${width}-${dark ? "dark" : "light"}.png`);
      await page.picture(picture);
      assert.ok(statSync(picture).size > PICTURE_MIN, `${name} is blank at ${width} px`);
    }
  }
  if (interactive && (await page.value("document.getElementById('time') !== null"))) {
    await use(page);
    await page.resize({ width: SIZES[0][0], height: SIZES[0][1] });
    await page.settle();
    await touch(page);
    console.log(`check-page: ${file} zoomed, scrubbed, played, touched`);
  }
  assert.deepEqual(page.errors, [], `no errors in the console of ${name}`);
  await page.close();
  console.log(`check-page: ${file} drawn at ${SIZES.map(([width]) => width).join(", ")} px, light and dark, no errors`);
}

mkdirSync(pictures, { recursive: true });
const browser = await Browser.start();
try {
  for (const file of files) await check(browser, file);
} finally {
  await browser.close();
}
