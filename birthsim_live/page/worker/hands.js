// The person's hand: `hold` is what it does, or null: { position, id } of a hand at a place, { force, id } of one that pushes.

export class Hands {
  constructor() {
    this.hold = null;
    this.used = null;
  }

  /** Do so from now on. */
  act(session) {
    const { position, force, id } = this.hold ?? {};
    session.loop.set("pointer_held", Number(Boolean(position)));
    if (position) session.fill("pointer_x", position);
    session.fill("push_x", force ?? [0, 0]);
    this.used = id ?? this.used;
  }

  /** Where the spring from `place` ends, or would end for a hand that pushes; nowhere where there is no hand. */
  pointer(place, stiffness) {
    const { position, force } = this.hold ?? {};
    return position ?? place.map((value, k) => (force ? value + force[k] / stiffness : NaN));
  }
}
