// A gamepad pushes the heads: its left stick is a force.

const MOST = 60; // N, of a stick at its end
const DEAD = 0.12; // of the way: a stick at rest is never quite in the middle

export class Gamepad {
  /** `enabled()` says whether there is a rig to push. */
  constructor(hand, enabled) {
    Object.assign(this, { hand, enabled });
  }

  /** Called with each frame of the screen: browsers tell of buttons and sticks only who asks. */
  step() {
    const stick = navigator.getGamepads?.().find(Boolean)?.axes.slice(0, 2);
    const pushes = stick && Math.hypot(...stick) > DEAD && this.enabled();
    if (pushes && this.hand.free(this)) this.hand.act(this, { type: "push", force: [MOST * stick[0], -MOST * stick[1]] });
    else if (!pushes && this.hand.holder === this) this.hand.release();
  }

  letGo() {}
}
