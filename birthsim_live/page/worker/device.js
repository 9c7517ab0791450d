// A Haply Inverse3 as the hand. Its service on this machine (Inverse Service 3.1) says in every message where the handle is, and
// sends the next one when it is told which force the handle shall make: 1000 times a second.

const ADDRESS = "ws://127.0.0.1:10001";
const SHARE = 0.1; // of the rig's force: the device makes some 10 N, the rig 100 N

export class Device {
  /** `hub` takes the hand's messages; `ended(reason)` is told once, with words where something went wrong. */
  constructor(hub, ended) {
    Object.assign(this, { hub, ended, first: null });
    this.socket = new WebSocket(ADDRESS);
    this.socket.addEventListener("message", ({ data }) => this.move(JSON.parse(data)));
    this.socket.addEventListener("close", () => this.end(`device = ${ADDRESS} does not answer; allowed: a running Haply Inverse Service`));
  }

  /** The handle has moved since it was first seen; so far does the hand move from where the head was then. */
  move({ inverse3: [handle] = [] }) {
    if (!handle) return;
    const { device_id: id, state } = handle;
    const { x, z } = state.cursor_position; // m: to the right, and up
    const { session, clock } = this.hub;
    this.first ??= { x, z, head: session.some("x", 2) };
    const { head } = this.first;
    this.hub.on_drag({ position: [head[0] + x - this.first.x, head[1] + z - this.first.z] });
    clock.catchUp();
    const [along, up] = session.some("pointer_force_x", 2).map((force) => (session.halted ? 0 : -SHARE * force));
    const values = { x: along, y: 0, z: up };
    this.socket.send(JSON.stringify({ inverse3: [{ device_id: id, commands: { set_cursor_force: { values } } }] }));
  }

  /** Let go of the head; `reason` is why, or nothing where a person wants it. */
  end(reason) {
    if (this.over) return;
    this.over = true;
    this.hub.on_release();
    this.socket.close();
    this.ended(reason);
  }
}
