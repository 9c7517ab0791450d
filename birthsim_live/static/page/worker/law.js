// A controller: the stages of its law, and the policy that works on top of some (agents/policy/controller.py).

export class Law {
  /** `packed` is the pack's controller, `policy` the stage of its policy, where it has one. */
  constructor(rig, packed, policy) {
    const { machine } = rig;
    this.rig = rig;
    this.damped = packed.damped;
    this.kinds = { true: packed.sampled, false: packed.measured };
    this.made = {};
    this.seen = machine.rows(rig.rows.SEEN);
    this.policy = packed.policy ?? null;
    if (this.policy) this.decide = machine.stage(policy);
    this.reset();
  }

  /** Forget the past. */
  reset() {
    this.sampled = null;
    if (!this.policy) return;
    this.decide.restart();
    const { ACTION, SHOWN } = this.rig.rows;
    const { size, shown } = this.policy;
    this.seen.fill(ACTION, new Array(size).fill(0));
    this.seen.fill(SHOWN, Array.from({ length: shown }, (_, k) => (k >= size && k < size + 2 ? 1 : 0)));
  }

  /** The law's stages for one kind of sensors, fresh where that is another one than in the last period. */
  stages(sampled) {
    this.made[sampled] ??= this.kinds[sampled].map((packed) => this.rig.machine.stage(packed));
    if (sampled !== this.sampled) for (const stage of this.made[sampled]) stage.restart();
    this.sampled = sampled;
    return this.made[sampled];
  }

  /** Openings of the valves of chambers P1, N1, P2, N2 for what is `seen`; null where the law cannot serve it. */
  openings(seen, sampled, damping) {
    const { rows } = this.rig;
    const own = this.seen;
    const stages = this.stages(sampled);
    own.copy(seen, 0, rows.ASKED);
    if (this.policy?.force_sensor === false) own.fill(rows.USER_FORCE, [0, 0]);
    this.decide?.run(own);
    own.fill(rows.ASKED, own.some(rows.REFERENCE, rows.ASKED - rows.REFERENCE));
    own.fill(rows.FEEDFORWARD, [0, 0, 0, 0, this.damped ? damping : 0]);
    return stages.every((stage) => stage.run(own)) ? own.some(rows.OPENING, 4) : null;
  }
}
