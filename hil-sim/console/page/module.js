// The WebAssembly module behind plain calls: bytes, text and JSON in and out.

/** Loads the module; `url` is where its bytes are. */
export async function load(url) {
  return instantiate(await WebAssembly.compileStreaming(fetch(url)));
}

/** An instance of a compiled module. */
export async function instantiate(compiled) {
  const { exports } = await WebAssembly.instantiate(compiled, {});
  return new Module(exports);
}

class Module {
  constructor(exports) {
    this.exports = exports;
    this.encoder = new TextEncoder();
    this.decoder = new TextDecoder();
  }

  /** Writes input for the next call. */
  give(bytes) {
    const data = typeof bytes === "string" ? this.encoder.encode(bytes) : bytes;
    const start = this.exports.input(data.length);
    new Uint8Array(this.exports.memory.buffer, start, data.length).set(data);
  }

  /** Calls a function whose answer is bytes; the bytes are the caller's. */
  bytes(name, ...values) {
    const length = this.exports[name](...values);
    return new Uint8Array(this.exports.memory.buffer, this.exports.output(), length).slice();
  }

  /** Calls a function whose answer is text. */
  text(name, ...values) {
    return this.decoder.decode(this.bytes(name, ...values));
  }

  /** Calls a function whose answer is JSON. */
  json(name, ...values) {
    return JSON.parse(this.text(name, ...values));
  }

  /** Calls a function whose answer is nothing, or a number. */
  call(name, ...values) {
    return this.exports[name](...values);
  }

  /** A hash of 64 bits as the host's tools print it. */
  hash(name) {
    return BigInt.asUintN(64, this.exports[name]()).toString(16).padStart(16, "0");
  }
}
