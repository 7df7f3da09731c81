// The host's end of the link: the module decides what to say, a transport carries the bytes.

// How often the page looks whether it is time to, ms; it also looks whenever the board says something.
const LOOK_MS = 10;

export class Link {
  /**
   * `module` is an instance of its own; `command()` returns {speed, yaw}, or null when the operator is silent; the operator
   * speaks every `periodUs`.
   */
  constructor(module, transport, command, periodUs) {
    this.periodUs = periodUs;
    this.module = module;
    this.transport = transport;
    this.command = command;
    this.onheard = () => {};
    const nonce = crypto.getRandomValues(new Uint32Array(1))[0];
    module.call("link_begin", nonce);
    transport.onbytes = (bytes) => this.receive(bytes);
    this.spokenUs = -periodUs;
    this.timer = setInterval(() => this.speak(), LOOK_MS);
  }

  receive(bytes) {
    this.module.give(bytes);
    const heard = this.module.json("link_receive", this.transport.nowUs());
    this.onheard(heard);
    this.speak();
  }

  speak() {
    const nowUs = this.transport.nowUs();
    if (nowUs - this.spokenUs >= this.periodUs) {
      const command = this.command();
      if (command) this.module.call("link_drive", nowUs, command.speed, command.yaw);
      this.spokenUs = nowUs;
    }
    this.flush();
  }

  flush() {
    const bytes = this.module.bytes("link_poll", this.transport.nowUs());
    if (bytes.length > 0) this.transport.send(bytes);
  }

  operate(on) {
    this.module.call("link_operate", on ? 1 : 0);
  }

  arm() {
    this.order("link_arm");
  }

  disarm() {
    this.order("link_disarm");
  }

  clearFaults() {
    this.order("link_clear_faults");
  }

  order(name, ...values) {
    this.module.call(name, this.transport.nowUs(), ...values);
    this.flush();
  }

  parameters() {
    return this.module.json("link_parameters");
  }

  vehicleFile() {
    return this.module.text("link_vehicle_file");
  }

  change(changes) {
    this.module.give(JSON.stringify(changes));
    return this.module.text("link_change");
  }

  builtIn() {
    this.module.call("link_built_in");
  }

  compare(text) {
    this.module.give(text);
    return this.module.json("link_compare");
  }

  record(on) {
    this.order("link_record", on ? 1 : 0);
  }

  /** The frames of the recording, which the module then has no more. */
  takeRecording() {
    return this.module.bytes("link_take_recording");
  }

  async close() {
    clearInterval(this.timer);
    await this.transport.close();
  }
}
