// The three ways to a board. Each has open(), send(bytes), close(), nowUs(), and calls its listeners.

class Transport {
  constructor() {
    this.onbytes = () => {};
    /** Called once, with the reason, when the way is gone. */
    this.onclose = () => {};
    this.closed = false;
  }

  /** The host's clock, us. */
  nowUs() {
    return performance.now() * 1000;
  }

  gone(reason) {
    if (this.closed) return;
    this.closed = true;
    this.onclose(reason);
  }
}

/** The vehicle in the page: board and plant in a worker. */
export class SimulatedTransport extends Transport {
  constructor(world, wasm) {
    super();
    this.world = world;
    this.wasm = wasm;
    this.boardUs = 0;
    this.onseen = () => {};
    this.onrefused = () => {};
  }

  open() {
    this.worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    return new Promise((resolve, reject) => {
      this.worker.onerror = (event) => reject(new Error(event.message || "the simulation does not start"));
      this.worker.onmessage = ({ data }) => {
        if (data.what === "booted") resolve();
        else if (data.what === "failed") reject(new Error(data.error));
        else if (data.what === "refused") this.onrefused(data.error);
        else if (data.what === "ran" && !this.closed) {
          this.boardUs = data.seen.now_us;
          this.onseen(data.seen);
          this.onbytes(data.bytes);
          this.worker.postMessage({ what: "taken", nowUs: data.seen.now_us });
          if (data.seen.ended) this.gone(`the simulation ended: ${data.seen.ended}`);
        }
      };
      this.worker.postMessage({ what: "boot", world: this.world, url: this.wasm });
    });
  }

  // The simulated second may be longer or shorter than the page's: the board's own time is the clock.
  nowUs() {
    return this.boardUs;
  }

  send(bytes) {
    this.worker.postMessage({ what: "bytes", bytes });
  }

  setRate(rate) {
    this.worker.postMessage({ what: "rate", rate });
  }

  /** Lets a step of a scenario happen, in the words of scenario files. */
  act(step) {
    this.worker.postMessage({ what: "act", step });
  }

  async close() {
    this.worker?.terminate();
    this.gone("the simulation is closed");
  }
}

/** A served board over a WebSocket: `hil-sim serve --websocket`. */
export class SocketTransport extends Transport {
  constructor(url) {
    super();
    this.url = url;
  }

  open() {
    return new Promise((resolve, reject) => {
      this.socket = new WebSocket(this.url);
      this.socket.binaryType = "arraybuffer";
      this.socket.onopen = () => {
        this.opened = true;
        resolve();
      };
      this.socket.onmessage = ({ data }) => {
        if (data instanceof ArrayBuffer) this.onbytes(new Uint8Array(data));
      };
      this.socket.onclose = () => {
        if (this.opened) this.gone("the server is gone");
        else reject(new Error(`nobody answers at ${this.url}: does \`cargo run -- serve --websocket 127.0.0.1:5761\` run?`));
      };
    });
  }

  send(bytes) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(bytes);
  }

  async close() {
    this.socket?.close();
    this.gone("the connection is closed");
  }
}

/** The real board over its serial port. `serial` is navigator.serial, or what stands for it. */
export class SerialTransport extends Transport {
  constructor(serial, baudRate) {
    super();
    this.serial = serial;
    this.baudRate = baudRate;
    this.waiting = Promise.resolve();
  }

  async open() {
    this.port = await this.serial.requestPort();
    await this.port.open({ baudRate: this.baudRate, bufferSize: 16384 });
    this.writer = this.port.writable.getWriter();
    this.reading = this.read();
  }

  async read() {
    while (this.port.readable && !this.closing) {
      this.reader = this.port.readable.getReader();
      try {
        for (;;) {
          const { value, done } = await this.reader.read();
          if (done) break;
          this.onbytes(value);
        }
      } catch (error) {
        // A framing or overrun error: the port offers a new stream. Without one the cable is pulled.
        if (!this.port.readable) this.gone(`the port is gone: ${error.message}`);
      } finally {
        this.reader.releaseLock();
      }
      if (!this.closing && !this.port.readable) break;
    }
    this.gone("the port is gone");
  }

  send(bytes) {
    if (this.closed || this.closing) return;
    this.writer.write(bytes).catch((error) => this.gone(`the port takes no more: ${error.message}`));
  }

  async close() {
    if (!this.port || this.closing) return;
    this.closing = true;
    // Ends the loop over the port's streams first: a port with a locked stream cannot be closed.
    await this.reader?.cancel().catch(() => {});
    await this.reading?.catch(() => {});
    this.writer?.releaseLock();
    await this.port.close().catch(() => {});
    this.gone("the port is closed");
  }
}
