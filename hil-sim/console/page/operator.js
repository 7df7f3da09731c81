// What the operator does: keys, joystick on the screen, gamepad; and when the operator counts as silent.

const KEYS = {
  ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0],
  ArrowLeft: [0, 1], KeyA: [0, 1], ArrowRight: [0, -1], KeyD: [0, -1],
};
// Below this a gamepad's stick is at rest.
const DEAD_ZONE = 0.12;
// The lower and the right button of the right hand: A and B.
const GAMEPAD_STOP = [0, 1];
// Where keys write.
const WRITES = "input:not([type=range]), select, textarea";

export class Operator {
  /** `elements`: pad, knob, speed, yaw. `onstop` is called at each wish to stop. */
  constructor(elements, onstop) {
    this.elements = elements;
    this.onstop = onstop;
    this.held = new Set();
    this.pad = [0, 0];
    /** The finger or mouse that holds the joystick on the screen. */
    this.pointer = null;
    /** After a stop, until everything is let go. */
    this.stopped = false;
    /** Something was commanded since the last stop: the next one is a first one. */
    this.drivenOn = false;
    this.gamepadStop = false;
    /** The gamepad's stick has been at rest since the operator let go: what it says is meant. */
    this.stickFree = false;
    /** Set while the page shows something else than the vehicle: nothing drives it then, and the stop stops. */
    this.away = false;
    /** Set while the page drives a vehicle of its own or has the wheel of another. */
    this.speaks = false;
    addEventListener("keydown", (event) => this.keydown(event), { capture: true });
    addEventListener("keyup", (event) => this.keyup(event), { capture: true });
    // Whoever cannot be seen to hold a key does not hold it.
    addEventListener("blur", () => this.letGo());
    // The menu takes the keys, and their release with them.
    addEventListener("contextmenu", () => this.letGo());
    document.addEventListener("visibilitychange", () => this.letGo());
    addEventListener("pagehide", () => this.letGo());
    // A key that is held does not drive on while the keys write.
    addEventListener("focusin", ({ target }) => {
      if (target.matches?.(WRITES)) this.held.clear();
    });
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
    // A key that is held on the stop is one press of it.
    if (event.repeat && event.key === "Enter" && event.target.matches?.("#stop")) event.preventDefault();
    if (event.metaKey) this.held.clear();
    const slides = event.target.matches?.("input[type=range]") && event.code.startsWith("Arrow");
    const writes = slides || event.target.matches?.(WRITES);
    if (writes || event.ctrlKey || event.altKey || event.metaKey || !(event.code in KEYS)) return;
    // The page does not scroll while it drives, and the log does.
    if (event.target.matches?.(".scroll, pre")) return;
    event.preventDefault();
    if (!event.repeat) this.held.add(event.code);
  }

  keyup(event) {
    this.held.delete(event.code);
    // On a Mac no key that is released beside Command says so.
    if (event.metaKey || event.key === "Meta") this.held.clear();
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
      // The first finger drives; a second one, or another button of the mouse, does not.
      if (this.pointer !== null || event.button !== 0) return;
      this.pointer = event.pointerId;
      pad.setPointerCapture(event.pointerId);
      move(event);
    });
    pad.addEventListener("pointermove", (event) => {
      if (event.pointerId === this.pointer) move(event);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
      pad.addEventListener(end, (event) => {
        if (event.pointerId === this.pointer) this.centre();
      });
    // A slider that the mouse has set gives the arrow keys back.
    for (const slider of [this.elements.speed, this.elements.yaw]) slider.addEventListener("pointerup", () => slider.blur());
  }

  centre() {
    this.pointer = null;
    this.pad = [0, 0];
    this.elements.knob.style.transform = "";
  }

  /** Whatever is held counts no more, until it is let go and held again. */
  letGo() {
    this.held.clear();
    this.centre();
    this.stickFree = false;
  }

  stop() {
    this.stopped = true;
    this.onstop();
    this.drivenOn = false;
  }

  gamepad() {
    const pad = this.present() ? navigator.getGamepads?.().find((each) => each?.connected) : undefined;
    const pressed = pad ? GAMEPAD_STOP.some((button) => pad.buttons[button]?.pressed) : false;
    if (pressed && !this.gamepadStop) this.stop();
    this.gamepadStop = pressed;
    this.gamepadName = pad?.id ?? "none";
    if (!pad) {
      this.stickFree = false;
      return [0, 0];
    }
    const axis = (value) => (Math.abs(value ?? 0) < DEAD_ZONE ? 0 : -value);
    const stick = [axis(pad.axes[1]), axis(pad.axes[0])];
    this.stickFree ||= stick[0] === 0 && stick[1] === 0;
    return this.stickFree ? stick : [0, 0];
  }

  /** {speed, yaw} to command now, or null when the operator is silent. */
  command() {
    const wish = this.gamepad();
    if (!this.speaks || !this.present()) return null;
    if (this.away) return { speed: 0, yaw: 0 };
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
    this.drivenOn ||= wish[0] !== 0 || wish[1] !== 0;
    return { speed: bounded(wish[0]) * Number(speed.value), yaw: bounded(wish[1]) * Number(yaw.value) };
  }
}
