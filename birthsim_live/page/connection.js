// The connection to the rig: a WebSocket, which comes back when the server does. The messages are in docs/live.md. The page
// without a server has another file in this one's place, with the same face.

const FIRST_WAIT = 0.5; // s
const LONGEST_WAIT = 8; // s

export class Connection {
  /** `handlers`: one function per type of message, `closed(seconds until the next try)`, and `failed({ message })` for good. */
  constructor(handlers) {
    this.handlers = handlers;
    this.wait = FIRST_WAIT;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/ws`);
    this.socket.addEventListener("message", (event) => this.receive(event.data));
    this.socket.addEventListener("close", () => this.retry());
  }

  receive(text) {
    const message = JSON.parse(text);
    // Only a greeting shows that the server really takes this window: until then waits keep growing.
    if (message.type === "hello") this.wait = FIRST_WAIT;
    this.handlers[message.type]?.(message);
  }

  retry() {
    this.handlers.closed(this.wait);
    setTimeout(() => this.open(), 1e3 * this.wait);
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
  }

  /** Where the recording `name` can be saved from. */
  address(name) {
    return `recordings/${encodeURIComponent(name)}`;
  }

  /** False where there is nobody to send to. */
  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
