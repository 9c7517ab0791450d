// The connection to the rig, which runs in a worker of this window. The messages are in docs/live.md.

export class Connection {
  /** `handlers`: one function per type of message, and `failed({ message })` for good. */
  constructor(handlers) {
    this.recordings = new Map();
    this.worker = new Worker(new URL("./worker/worker.js", import.meta.url), { type: "module" });
    this.worker.addEventListener("message", ({ data }) => this.receive(data, handlers));
    // A worker that cannot be loaded says no more than that.
    this.worker.addEventListener("error", (event) => handlers.failed({ message: event.message || "its program cannot be loaded" }));
  }

  receive(message, handlers) {
    if (message.type === "recorded") this.recordings.set(message.name, URL.createObjectURL(message.file));
    else handlers[message.type]?.(message);
  }

  /** Where the recording `name` can be saved from. */
  address(name) {
    return this.recordings.get(name);
  }

  send(message) {
    this.worker.postMessage(message);
    return true;
  }
}
