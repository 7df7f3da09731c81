// The simulated board, beside the page: real time in, bytes of the link and the truth out.
import { load } from "./module.js";

// Most simulated time in one go, ms: a machine that slept does not catch up.
const STRIDE_MAX_MS = 60;
const PERIOD_MS = 15;
// How far the board runs ahead of a page that is busy, us: such a page slows the simulated world and loses no operator.
const AHEAD_MAX_US = 100_000;

let module;
let rate = 1;
let owed = 0;
let last = 0;
// The board's time, and that up to which the page has taken what the board said, us.
let boardUs = 0;
let takenUs = 0;

onmessage = async ({ data }) => {
  switch (data.what) {
    case "boot": {
      module = await load(data.url);
      module.give(JSON.stringify(data.world));
      const error = module.text("board_boot");
      if (error) {
        postMessage({ what: "failed", error });
        return;
      }
      last = performance.now();
      postMessage({ what: "booted" });
      setInterval(go, PERIOD_MS);
      return;
    }
    case "bytes":
      module.give(data.bytes);
      module.call("board_send");
      return;
    case "taken":
      takenUs = data.nowUs;
      return;
    case "rate":
      rate = data.rate;
      return;
    case "act": {
      module.give(data.step);
      const error = module.text("board_act");
      if (error) postMessage({ what: "refused", error });
      return;
    }
    case "hash":
      postMessage({ what: "hash", hash: (await load(data.url)).hash("trace_hash") });
  }
};

function go() {
  const now = performance.now();
  owed += (now - last) * rate;
  last = now;
  const ms = Math.min(Math.floor(owed), STRIDE_MAX_MS * Math.max(rate, 1));
  owed = Math.min(owed - ms, STRIDE_MAX_MS);
  if (ms < 1 || boardUs - takenUs > AHEAD_MAX_US) return;
  const bytes = module.bytes("board_run", ms);
  const seen = module.json("board_look");
  boardUs = seen.now_us;
  postMessage({ what: "ran", bytes, seen }, [bytes.buffer]);
}
