"""Every fault, provoked on a simulated rig: its stated end is reached, and nothing is harmed."""

import math

import numpy as np
import pytest

from baselines.controller import PlainController
from birthsim_drive.loop.control import COURSE, FADE, HOLDS
from birthsim_drive.loop.record import Period, Record
from birthsim_drive.provoked import KINDS as PROVOKED
from birthsim_drive.safety.faults import ACTIONS, CLOSE, HOLD, KINDS, LASTS, VENT, WATCHED
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import Drive, law_of
from birthsim_drive.simulated import WATCHDOG, Simulated
from birthsim_env.loop.guard import FAULT_TIME
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.rig.parameters import Parameters
from tests.drive.rigs import PROBE, RIG, drive

PERIOD = RIG.electronics.control_period

AT = 0.1
"""s after which something goes wrong."""

SEEN = {
    # kind -> what is found, and how long after it began at the latest, s
    "nan-pressure": ("not finite", FAULT_TIME),
    "nan-position": ("not finite", FAULT_TIME),
    "nan-force": ("not finite", FAULT_TIME),
    "infinite-velocity": ("not finite", FAULT_TIME),
    "high-pressure": ("pressure", 0.0),
    "no-pressure": ("pressure", 0.0),
    "fast": ("speed", 0.0),
    "pushed": ("force", 0.0),
    "moved": ("workspace", 0.0),
    "blind": ("blind", Limits().position_age),
    "frozen": ("frozen", FAULT_TIME),
    "nan-clock": ("not finite", FAULT_TIME),
    "clock-back": ("clock", 0.0),
    "silence": ("missing", FAULT_TIME),
    "damaged": ("missing", FAULT_TIME),
    "shut": ("rig", 0.0),
}

HARMLESS = {"foreign", "twice"}

STUCK = {"stuck-pressure": ("stuck", Limits().stuck_time)}
"""Found where a valve is open, which that of a resting rig is not."""


def unharmed(fate):
    """Whether a rig is as it should be: it met its stops no harder than a head that sinks, and has no pressure that its supply
    and its weight do not give it."""
    supply = RIG.air.supply_pressure
    return fate.impact < 0.1 and fate.speed < 0.3 and fate.pressures[0] > 0.9e5 and fate.pressures[1] < supply + 1e5


def ended_as(loop, record, fate, kind, action):
    """The openings of a stated end were the last that the loop wrote, and the last that the rig had before it let go."""
    rows = record.kept[Period.opening.place]
    return (
        loop.faults[0].kind == kind
        and loop.faults[0].action == action
        and rows[:, -1].tolist() == [loop.limits.end(action)[0]] * 4
    )


def test_whatever_can_be_provoked_is_tried():
    assert {*SEEN, *HARMLESS, *STUCK} == {*PROVOKED}


@pytest.mark.parametrize("kind", SEEN)
@pytest.mark.parametrize("action", [CLOSE, VENT])
def test_a_fault_ends_as_its_owner_wants(tmp_path, kind, action):
    # What stops packets needs a rig that goes on without answers.
    lockstep = kind not in ("silence", "damaged", "frozen")
    simulated = Simulated(PROBE, RIG, "lab", lockstep=lockstep, provoked=(f"{kind}@{AT}",))
    loop, record, fate = drive(tmp_path, simulated, limits=Limits(default=action), duration=2.0)
    found, within = SEEN[kind]
    assert ended_as(loop, record, fate, found, action), loop.faults
    if lockstep:
        came = loop.faults[0].time + (1.0 if kind == "clock-back" else 0.0)
        # A position is some periods old where it comes.
        assert -0.02 <= came - AT - within <= 3 * PERIOD
    assert unharmed(fate)


@pytest.mark.parametrize("kind", sorted(HARMLESS))
def test_packets_of_others_and_twice_change_nothing(tmp_path, kind):
    simulated = Simulated(PROBE, RIG, "lab", lockstep=True, provoked=(f"{kind}@0.1",))
    loop, record, _ = drive(tmp_path, simulated)
    plain, clean, _ = drive(tmp_path, Simulated(PROBE, RIG, "lab", lockstep=True))
    assert loop.faults == plain.faults == []
    course = record.kept[:, record.kept[Period.phase.first] == COURSE]
    same = clean.kept[:, clean.kept[Period.phase.first] == COURSE]
    own = slice(Period.signals.first, Period.law.place.stop)
    assert course[own].tolist() == same[own].tolist()


def test_a_cell_that_stands_still_under_an_open_valve_is_found(tmp_path):
    simulated = Simulated(PROBE, RIG, "lab", lockstep=True, provoked=("stuck-pressure@0.0",))
    opens = PlainController(lambda measurement, reference: np.array([[0.0], [0.0], [0.55], [0.55]]))
    loop, _, fate = drive(tmp_path, simulated, law=opens, duration=2.0)
    assert loop.faults[0].kind == "stuck"
    assert loop.faults[0].time == pytest.approx(Limits().stuck_time, abs=3 * PERIOD)
    assert fate.impact == 0.0


def test_a_short_gap_is_bridged(tmp_path):
    simulated = Simulated(PROBE, RIG, "lab", lockstep=True, provoked=(f"nan-pressure@0.1+{FAULT_TIME / 2}",))
    loop, record, _ = drive(tmp_path, simulated)
    assert loop.faults == []
    assert np.isfinite(record.kept[Period.opening.place]).all()


class Broken:
    """A driver that fails in one of its methods from a time on."""

    def __init__(self, driver, method, error):
        self.driver, self.stopped, self._left = driver, 0, 150
        self._method, self._error = method, error

    def __getattr__(self, name):
        return getattr(self.driver, name)

    def _count(self, method):
        if method == self._method:
            self._left -= 1
            if self._left < 0:
                raise self._error

    def read(self):
        self._count("read")
        return self.driver.read()

    def write(self, openings):
        self._count("write")
        self.driver.write(openings)

    def stop(self):
        self.stopped += 1
        self.driver.stop()


@pytest.mark.parametrize("method", ["read", "write"])
def test_a_driver_that_fails_is_stopped(tmp_path, method):
    made = []

    def wrap(driver):
        made.append(Broken(driver, method, OSError("the bus is gone")))
        return made[0]

    loop, _, fate = drive(tmp_path, Simulated(PROBE, RIG, "lab"), wrap=wrap)
    assert loop.faults[0].kind == method
    assert "the bus is gone" in loop.faults[0].said
    assert made[0].stopped == 1
    assert fate.openings == [0.0] * 4
    assert unharmed(fate)


class Failing:
    """A controller that fails, or returns no openings, from a time on."""

    def __init__(self, what):
        self._what = what

    def command(self, measurement, reference):
        if measurement.time[0] < AT:
            return np.zeros((4, 1))
        if isinstance(self._what, Exception):
            raise self._what
        return np.full((4, 1), self._what)

    def reset(self, lanes=None):
        pass


@pytest.mark.parametrize(
    ("what", "kind"), [(RuntimeError("no idea"), "controller"), (math.nan, "opening"), (3.0, "opening"), (math.inf, "opening")]
)
def test_a_controller_that_fails_ends_the_control(tmp_path, what, kind):
    loop, record, fate = drive(tmp_path, law=Failing(what))
    assert loop.faults[0].kind == kind
    assert loop.faults[0].time == pytest.approx(AT, abs=2 * PERIOD)
    rows = record.kept[Period.opening.place]
    assert np.isfinite(rows).all()
    assert not rows.any()
    assert unharmed(fate)


def test_a_target_too_far_away_is_found(tmp_path):
    loop, _, fate = drive(tmp_path, law=Failing(0.0), limits=Limits(deviation=-1.0))
    assert loop.faults[0].kind == "deviation"
    assert unharmed(fate)


class Slow(Failing):
    def command(self, measurement, reference):
        import time

        time.sleep(2 * PERIOD)
        return np.zeros((4, 1))


def test_in_lockstep_nothing_is_late(tmp_path):
    loop, _, _ = drive(tmp_path, law=Slow(0.0), duration=0.1)
    assert loop.faults == []


def test_openings_computed_too_late_end_the_control(tmp_path):
    loop, _, fate = drive(tmp_path, law=Slow(0.0), by_clock=True)
    assert loop.faults[0].kind == "late"
    assert loop.faults[0].time <= (Limits().late_periods + 2) * PERIOD
    assert unharmed(fate)


def test_a_rig_that_says_nothing_is_given_up(tmp_path):
    simulated = Simulated(PROBE, RIG, "lab", provoked=("silence@0",))
    loop, record, fate = drive(tmp_path, simulated, limits=Limits(start_time=0.3))
    assert [one.kind for one in loop.faults] == ["start"]
    assert not record.kept[Period.opening.place].any()
    assert unharmed(fate)


class Asks:
    """A driver during which somebody asks the loop to end."""

    def __init__(self, driver, record, after):
        self._driver, self._record, self._left = driver, record, after

    def __getattr__(self, name):
        return getattr(self._driver, name)

    def write(self, openings):
        self._left -= 1
        if self._left == 0:
            self._record.ask_to_end()
        self._driver.write(openings)


def asked_to_end(tmp_path, **options):
    """A drive on the circle that somebody asks to end after 0.3 s."""
    simulated = Simulated("BirthSIM/Circle-v2", RIG, "ideal", lockstep=True)
    told = {"environment": "BirthSIM/Circle-v2", "controller": "backstepping", "duration": 1.0, **options}
    return drive(tmp_path, simulated, wrap=lambda driver: Asks(driver, Record(tmp_path / "periods"), 300), **told)


def test_holding_keeps_the_head_where_its_target_was(tmp_path):
    loop, record, fate = asked_to_end(tmp_path, limits=Limits(on_fault={"interrupted": HOLD}))
    assert [(one.kind, one.action) for one in loop.faults] == [("interrupted", HOLD)]
    rows = record.kept
    holding = rows[Period.phase.first] == HOLDS
    assert holding.sum() == pytest.approx(700, abs=2)
    targets = Signals(rows[Period.signals.place]).reference.position[:, holding]
    assert np.ptp(targets, axis=1).tolist() == [0.0, 0.0]
    assert unharmed(fate)


def test_a_drive_that_is_asked_to_end_fades_out(tmp_path):
    loop, record, fate = asked_to_end(tmp_path, ramp=0.2)
    assert [one.kind for one in loop.faults] == ["interrupted"]
    fading = record.kept[Period.phase.first] == FADE
    assert fading.sum() == pytest.approx(200, abs=2)
    sizes = np.abs(record.kept[Period.opening.place]).max(axis=0)
    laws = np.abs(record.kept[Period.law.place]).max(axis=0)
    assert (sizes <= laws)[fading].all()
    assert sizes[fading][-1] < 0.01 < laws[fading].max()
    assert sizes[-1] == 0.0
    assert unharmed(fate)


def test_a_fault_that_lasts_while_it_holds_closes(tmp_path):
    limits = Limits(deviation=-1.0, on_fault={"deviation": HOLD})
    loop, record, fate = drive(tmp_path, limits=limits, duration=3.0)
    assert [(one.kind, one.action) for one in loop.faults] == [("deviation", HOLD), ("deviation", CLOSE)]
    assert loop.faults[1].time - loop.faults[0].time == pytest.approx(LASTS, abs=2 * PERIOD)
    assert not record.kept[Period.opening.place][:, -1].any()
    assert unharmed(fate)


def test_a_rig_whose_driver_is_gone_closes_its_own_valves(tmp_path):
    class Mute(Broken):
        def write(self, openings):
            self._left -= 1
            if self._left > 0:
                self.driver.write(openings)

    simulated = Simulated(PROBE, RIG, "lab")
    loop, _, fate = drive(tmp_path, simulated, wrap=lambda driver: Mute(driver, "", None), duration=3.0)
    assert loop.faults[0].kind == "rig"
    assert fate.openings == [0.0] * 4
    assert fate.missed >= WATCHDOG / PERIOD
    assert unharmed(fate)


def test_a_dry_run_opens_no_valve(tmp_path):
    loop, record, fate = drive(tmp_path, dry=True, controller="backstepping")
    rows = record.kept
    assert not rows[Period.opening.place].any()
    assert np.abs(rows[Period.law.place]).max() > 0.01
    assert fate.openings == [0.0] * 4
    assert loop.faults == []


def test_every_kind_is_told_apart_and_acts_as_stated():
    limits = Limits(default=HOLD, on_fault={"pressure": VENT}).for_rig(Parameters())
    assert limits.action("pressure") == VENT
    for kind, about in KINDS.items():
        if kind not in WATCHED and kind != "pressure":
            assert limits.action(kind) == (HOLD if about.may_hold else CLOSE)
    said = "\n".join(limits.words())
    assert all(action in said and about in said for action, about in ACTIONS.items())


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_a_controller_remembers_across_a_missing_sample(tmp_path, sensors):
    class Skips(Broken):
        def read(self):
            seen = self.driver.read()
            self._left -= 1
            if self._left == 0:
                raise TimeoutError
            return seen

    told = Drive("udp", "backstepping-integral", RIG, Limits().for_rig(RIG))
    law, made = law_of(told), []
    build = type(law).controller_stages

    def count(self, sampled):
        made.append(sampled)
        return build(self, sampled)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(law), "controller_stages", count)
        simulated = Simulated(PROBE, RIG, sensors, lockstep=True)
        loop, _, fate = drive(tmp_path, simulated, law=law, wrap=lambda driver: Skips(driver, "", None))
    assert loop.faults == []
    assert made == [True] if sensors == "lab" else made == [True, False]
    assert unharmed(fate)


@pytest.mark.parametrize(("controller", "kinds"), [("admittance-adaptive", ["not finite"]), ("backstepping", [])])
def test_a_controller_that_needs_a_force_is_not_told_0_where_nobody_measures_it(tmp_path, monkeypatch, controller, kinds):
    monkeypatch.setattr("birthsim_drive.simulated.FORCE", 0)
    loop, record, _ = drive(tmp_path, controller=controller, limiter=False)
    assert [one.kind for one in loop.faults] == kinds
    assert "user_force" in loop.faults[0].said if kinds else record.count > 500
