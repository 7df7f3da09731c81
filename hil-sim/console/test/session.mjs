// A session with the page's own module under node: the same orders as hil-sim/console/examples/session_hash.rs.
//
// node hil-sim/console/test/session.mjs MODULE.wasm
import { readFileSync } from "node:fs";
import { instantiate } from "../page/module.js";

const compiled = await WebAssembly.compile(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(compiled);
if (imports.length > 0) throw new Error(`imports: ${imports.map((i) => `${i.module}.${i.name}`)}`);

const board = await instantiate(compiled);
const link = await instantiate(compiled);
board.give("{}");
const error = board.text("board_boot");
if (error) throw new Error(error);
link.call("link_begin", 7);
link.call("link_operate", 1);
for (let step = 0; step < 1500; step += 1) {
  const nowUs = step * 10_000;
  if (step === 500) link.call("link_arm", nowUs);
  if (step % 2 === 0) {
    const [speed, yaw] = step >= 700 && step < 1200 ? [0.5, 0.25] : [0, 0];
    link.call("link_drive", nowUs, speed, yaw);
  }
  board.give(link.bytes("link_poll", nowUs));
  board.call("board_send");
  const said = board.bytes("board_run", 10);
  link.give(said);
  link.json("link_receive", nowUs + 10_000);
}
const { truth } = board.json("board_look");
if (!(truth.x_m > 1)) throw new Error(`the vehicle has not driven: x = ${truth.x_m} m`);
console.log(`session ${board.hash("board_hash")}`);
console.log(`drive ${(await instantiate(compiled)).hash("trace_hash")}`);
