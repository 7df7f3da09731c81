// Recording into a file, and replaying one through the same step.
import { tell } from "./panels.js";
import { download } from "./parameters.js";
import { History } from "./plots.js";

const element = (id) => document.getElementById(id);
// Ticks of one go of a replay.
const GO_TICKS = 5000;
// Largest file that is replayed in the page, bytes: a full recording of the page's own, as MCAP. Its statuses are kept.
const FILE_MAX = 256e6;
// Statuses per second of a replay: every tenth tick.
const STATUS_S = 0.01;

export class Records {
  /** `host`: link(), vehicleFile(), show(status), row(status), away(on): whether a record is shown instead of the vehicle. */
  constructor(host) {
    this.host = host;
    this.module = null;
    this.replaying = false;
    this.dirty = false;
    this.statuses = [];
    this.history = new History(Infinity);
    this.on = false;
    this.ending = false;
    element("record").addEventListener("click", () => this.toggle());
    element("replay").addEventListener("change", ({ target }) => this.open(target));
    element("scrub").addEventListener("input", () => this.show());
    element("play").addEventListener("click", () => this.play(!this.playing));
    element("end-replay").addEventListener("click", () => this.end());
  }

  get mode() {
    return this.statuses[element("scrub").value]?.mode ?? "none";
  }

  toggle() {
    const link = this.host.link();
    if (!link) {
      tell("recording: no board is connected");
      return;
    }
    // The last lines of the log are still to come: what is complete is saved (counted).
    if (this.ending) return;
    this.on = !this.on;
    this.ending = !this.on;
    this.label();
    link.record(this.on);
  }

  label() {
    element("record").setAttribute("aria-pressed", this.on);
    element("record").textContent = this.on ? "Stop and save" : "Record";
  }

  save(link) {
    // The page has the frames before anything is made of them: whatever fails then, they are saved.
    const frames = link.takeRecording();
    this.on = this.ending = false;
    this.label();
    if (frames.length === 0) {
      tell("recording: nothing came");
      return;
    }
    try {
      download(this.mcap(frames, link.vehicleFile()), "console.mcap", "application/octet-stream");
    } catch (error) {
      download(frames, "console.records", "application/octet-stream");
      tell(`recording: it could not be made MCAP (${error.message}); it is saved as console.records, which \`hil-sim replay console.records --mcap NAME.mcap\` makes MCAP`);
    }
  }

  /** The MCAP file of a recording's frames, with the vehicle file of the set in force. */
  mcap(frames, vehicleFile) {
    const error = this.module.text("mcap_make", this.give(vehicleFile, frames));
    if (error) throw new Error(error);
    return this.module.bytes("mcap_take");
  }

  /** Gives the module a text and bytes; the text's length. */
  give(text, bytes) {
    const head = new TextEncoder().encode(text);
    const both = new Uint8Array(head.length + bytes.length);
    both.set(head);
    both.set(bytes, head.length);
    this.module.give(both);
    return head.length;
  }

  /** The board is gone: saves what this link recorded until then. */
  stopped(link) {
    if ((this.on || this.ending) && link) this.save(link);
    this.on = this.ending = false;
    this.label();
    element("recording").textContent = "";
  }

  counted(counts) {
    if (!counts) return;
    if (counts.complete && (this.on || this.ending)) this.save(this.host.link());
    const seconds = (counts.ticks / 1000).toFixed(1);
    element("recording").textContent =
      `${seconds} s, ${(counts.bytes / 1000).toFixed(0)} kB, ${counts.lost_blocks} blocks lost${counts.full ? "; full: it has ended" : ""}`;
  }

  async open(input) {
    const file = input.files[0];
    input.value = "";
    if (!file) return;
    if (file.size > FILE_MAX) {
      tell(`${file.name}: ${(file.size / 1e6).toFixed(0)} MB, and a page has room for ${FILE_MAX / 1e6}: \`hil-sim replay\` reads it, and \`--until S\` makes a shorter one`);
      return;
    }
    const length = this.give(this.host.vehicleFile(), new Uint8Array(await file.arrayBuffer()));
    const error = this.module.text("replay_open", length);
    if (error) {
      tell(`${file.name}: ${error}`);
      return;
    }
    this.statuses = [];
    this.history.clear();
    let last;
    // When the boot under way began, in the time of the plots: a boot follows the one before.
    let [boot, bootedS] = [1, 0];
    do {
      last = this.module.json("replay_step", GO_TICKS);
      if (last.boot[0] !== boot) [boot, bootedS] = [last.boot[0], this.history.times.at(-1) ?? 0];
      for (const status of last.statuses) {
        this.statuses.push({ ...status, boot: last.boot });
        this.history.push(bootedS + status.time_us * 1e-6, this.host.row(status));
      }
      element("recording").textContent = `${file.name}: ${last.ticks[0]} of ${last.ticks[1]} ticks`;
      await new Promise((resolve) => setTimeout(resolve));
    } while (last.ticks[0] < last.ticks[1]);
    element("recording").textContent = "";
    const lost = last.lost_blocks + last.unreadable ? `; ${last.lost_blocks} blocks lost, ${last.unreadable} frames unreadable` : "";
    element("replay-note").textContent =
      `${file.name}: ${last.ticks[0]} ticks${last.boot[1] > 1 ? ` of ${last.boot[1]} boots` : ""}; ${last.differs ?? "every actuation is the recorded one, bit for bit"}${lost}`;
    element("scrub").max = this.statuses.length - 1;
    element("scrub").value = 0;
    element("replay-bar").hidden = false;
    this.replaying = this.dirty = true;
    this.host.away(true);
    this.show();
  }

  show() {
    const status = this.statuses[element("scrub").value];
    if (!status) return;
    const [boot, boots] = status.boot;
    element("replay-at").textContent = `${(status.time_us * 1e-6).toFixed(2)} s${boots > 1 ? ` of boot ${boot}` : ""}`;
    this.host.show(status);
  }

  play(on) {
    clearInterval(this.playing);
    this.playing = on ? setInterval(() => this.advance(), 50) : null;
    this.last = performance.now();
    element("play").setAttribute("aria-pressed", on);
    element("play").textContent = on ? "Pause" : "Play";
  }

  advance() {
    const now = performance.now();
    const scrub = element("scrub");
    const steps = Math.round((now - this.last) / 1000 / STATUS_S);
    this.last = now;
    if (Number(scrub.value) >= Number(scrub.max)) {
      this.play(false);
      return;
    }
    scrub.value = Number(scrub.value) + steps;
    this.show();
  }

  end() {
    this.play(false);
    this.replaying = false;
    this.statuses = [];
    this.host.away(false);
    element("replay-bar").hidden = true;
  }
}
