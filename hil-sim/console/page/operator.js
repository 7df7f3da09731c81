// What the operator does: keys, joystick on the screen, gamepad; and when the operator counts as silent.

const KEYS = {
  ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0],
  ArrowLeft: [0, 1], KeyA: [0, 1], ArrowRight: [0, -1], KeyD: [0, -1],
};
// Below this a gamepad's stick is at rest.
const DEAD_ZONE = 0.12;
const GAMEPAD_STOP = [0, 1];

export class Operator {
  /** `elements`: pad, knob, speed, yaw. `onstop` is called at each wish to stop. */
  constructor(elements, onstop) {
    this.elements = elements;
    this.onstop = onstop;
    this.held = new Set();
    this.pad = [0, 0];
    /** After a stop, until everything is let go. */
    this.stopped = false;
    this.gamepadStop = false;
    /** Set while the page drives a vehicle of its own or has the wheel of another. */
    this.speaks = false;
    addEventListener("keydown", (event) => this.keydown(event), { capture: true });
    addEventListener("keyup", (event) => this.held.delete(event.code), { capture: true });
    // Whoever cannot be seen to hold a key does not hold it.
    addEventListener("blur", () => this.letGo());
    document.addEventListener("visibilitychange", () => this.letGo());
    addEventListener("pagehide", () => this.letGo());
    this.listenToPad();
  }

  /** Whether the page can be sure that the operator sees it. */
  present() {
    return !document.hidden && document.hasFocus();
  }

  keydown(event) {
    if (event.code === "Space" && !event.ctrlKey && !event.altKey && !event.metaKey) {
      // Wherever the focus is: a button is pressed by Enter.
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.stop();
      return;
    }
    const typing = event.target.matches?.("input, select, textarea");
    if (typing || event.ctrlKey || event.altKey || event.metaKey || !(event.code in KEYS)) return;
    // The page does not scroll while it drives, and the log does.
    if (event.target.matches?.(".scroll, pre")) return;
    event.preventDefault();
    if (!event.repeat) this.held.add(event.code);
  }

  listenToPad() {
    const { pad, knob } = this.elements;
    const move = (event) => {
      const box = pad.getBoundingClientRect();
      const reach = box.width / 2 - 20;
      let x = (event.clientX - box.left - box.width / 2) / reach;
      let y = (event.clientY - box.top - box.height / 2) / reach;
      const length = Math.hypot(x, y);
      if (length > 1) [x, y] = [x / length, y / length];
      this.pad = [Math.abs(y) < DEAD_ZONE ? 0 : -y, Math.abs(x) < DEAD_ZONE ? 0 : -x];
      knob.style.transform = `translate(${x * reach}px, ${y * reach}px)`;
    };
    pad.addEventListener("pointerdown", (event) => {
      pad.setPointerCapture(event.pointerId);
      move(event);
    });
    pad.addEventListener("pointermove", (event) => {
      if (pad.hasPointerCapture(event.pointerId)) move(event);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) pad.addEventListener(end, () => this.centre());
  }

  centre() {
    this.pad = [0, 0];
    this.elements.knob.style.transform = "";
  }

  letGo() {
    this.held.clear();
    this.centre();
  }

  stop() {
    this.stopped = true;
    this.onstop();
  }

  gamepad() {
    const pad = this.present() ? navigator.getGamepads?.().find((each) => each?.connected) : undefined;
    const pressed = pad ? GAMEPAD_STOP.some((button) => pad.buttons[button]?.pressed) : false;
    if (pressed && !this.gamepadStop) this.stop();
    this.gamepadStop = pressed;
    this.gamepadName = pad?.id ?? "none";
    if (!pad) return [0, 0];
    const axis = (value) => (Math.abs(value ?? 0) < DEAD_ZONE ? 0 : -value);
    return [axis(pad.axes[1]), axis(pad.axes[0])];
  }

  /** {speed, yaw} to command now, or null when the operator is silent. */
  command() {
    const wish = this.gamepad();
    if (!this.speaks || !this.present()) return null;
    for (const code of this.held) {
      wish[0] += KEYS[code][0];
      wish[1] += KEYS[code][1];
    }
    wish[0] += this.pad[0];
    wish[1] += this.pad[1];
    if (this.stopped) {
      if (wish[0] === 0 && wish[1] === 0 && this.held.size === 0) this.stopped = false;
      else return { speed: 0, yaw: 0 };
    }
    const bounded = (value) => Math.max(-1, Math.min(1, value));
    const { speed, yaw } = this.elements;
    return { speed: bounded(wish[0]) * Number(speed.value), yaw: bounded(wish[1]) * Number(yaw.value) };
  }
}
