// What a person does to the simulated vehicle: pushes it, breaks its sensors. In the words of scenario files.

const element = (id) => document.getElementById(id);

export class World {
  /** `transport()` is the simulation's, or null. */
  constructor(transport) {
    const act = (step) => transport()?.act(step);
    const value = (id) => Number(element(id).value);
    const decimal = (number) => (Number.isInteger(number) ? `${number}.0` : `${number}`);
    const push = (direction, sign) => act(
      `action = "push"\non = "${element("push-on").value}"\n${direction} = ${decimal(sign * value("push-n"))}\nfor_s = ${decimal(value("push-s"))}`);
    element("push-forward").addEventListener("click", () => push("forward_n", 1));
    element("push-back").addEventListener("click", () => push("forward_n", -1));
    element("push-left").addEventListener("click", () => push("left_n", 1));
    const sensor = (fault) => act(`action = "sensor-fault"\nsensor = "${element("sensor").value}"\nfault = "${fault}"`);
    element("break-sensor").addEventListener("click", () => sensor(element("sensor-fault").value));
    element("mend-sensor").addEventListener("click", () => sensor("none"));
    element("set-battery").addEventListener("click", () => act(`action = "battery"\nopen_circuit_v = ${decimal(value("battery"))}`));
    this.toggle("stop-contact", ["Press emergency stop", "Release emergency stop"], (on) => act(`action = "emergency-stop"\npressed = ${on}`));
    this.toggle("chocks", ["Put chocks", "Take chocks away"], (on) => act(`action = "chocks"\nchocked = ${on}`));
  }

  toggle(id, [off, on], act) {
    element(id).addEventListener("click", ({ target }) => {
      const pressed = target.getAttribute("aria-pressed") !== "true";
      target.setAttribute("aria-pressed", pressed);
      target.textContent = pressed ? on : off;
      act(pressed);
    });
  }

  offer(faults) {
    element("sensor-fault").append(...faults.filter((name) => name !== "none").map((name) => new Option(name, name)));
  }

  show(on) {
    element("world").hidden = !on;
    for (const [id, text] of [["stop-contact", "Press emergency stop"], ["chocks", "Put chocks"]]) {
      element(id).setAttribute("aria-pressed", "false");
      element(id).textContent = text;
    }
  }
}
