"""The figures of an episode on made-up signals whose answers are known by hand."""

import math

import numpy as np
import pytest

from baselines.bench.metrics import NORMAL_DENSITY, UNITS, WINDOW, EpisodeMetrics

PERIOD = 4e-3
"""s; four control periods at a time keep the tests short."""
SINGLE = ("since_jump", "supply_flow")
RESTING = {
    "since_jump": 10.0,
    "supply_flow": 0.0,
    "tracking_error": (0.0, 0.0),
    "position": (0.5, 0.0),
    "velocity": (0.0, 0.0),
    "target": (0.5, 0.0),
    "user_force": (0.0, 0.0),
    "stiffness_setpoint": (2000.0, 2000.0),
    "pneumatic_stiffness": (4000.0, 2000.0),
    "pneumatic_stiffness_setpoint": (4000.0, 2000.0),
}


def measure(steps, lanes=1, period=PERIOD, command=0.0, alive=True, **signals):
    """Metrics after ``steps`` samples. A signal is (), (T,), (T, lanes) or with a last axis of 2 where it has x and y.

    The compliant target is that of uncoupled springs, unless it is given.
    """
    metrics = EpisodeMetrics(lanes, period)
    given = {**RESTING, **signals}
    compliance = np.asarray(given["user_force"]) / np.asarray(given["stiffness_setpoint"])
    given.setdefault("compliant_target", np.asarray(given["target"]) + compliance)
    shapes = {name: (steps, lanes) if name in SINGLE else (steps, lanes, 2) for name in given}
    full = {name: np.array(np.broadcast_to(np.asarray(given[name], dtype=float), shape)) for name, shape in shapes.items()}
    commands = np.broadcast_to(np.asarray(command, dtype=float), (steps, 4, lanes))
    living = np.broadcast_to(np.asarray(alive, dtype=bool), (steps, lanes))
    info = {name: np.empty_like(values[0]) for name, values in full.items()}  # the caller may reuse its arrays
    for k in range(steps):
        for name, values in full.items():
            info[name][:] = values[k]
        metrics.add(info, commands[k], living[k])
    return metrics.result()


def over_time(values):
    """(T,) as (T, 1, 1), or (T, 2) as (T, 1, 2)."""
    values = np.asarray(values, dtype=float)
    return values[:, None, None] if values.ndim == 1 else values[:, None, :]


def test_errors_whole_and_settled_are_rms_and_largest_size_in_millimetres():
    # 4 samples before the error counts as settled, then 6.
    error = 1e-3 * np.array([[9, -9]] * 4 + [[3, -4], [-3, 4], [3, 0], [-3, 0], [0, -4], [0, 0]])
    since = np.array([0.1, 0.2, 0.499, 0.4999, 0.5, 0.5001, 0.6, 1, 2, 3])
    result = measure(10, tracking_error=over_time(error), since_jump=since[:, None])
    assert result["error_rms_x"] == pytest.approx(math.sqrt((4 * 81 + 4 * 9) / 10))
    assert result["error_rms_y"] == pytest.approx(math.sqrt((4 * 81 + 3 * 16) / 10))
    assert (result["error_max_x"], result["error_max_y"]) == (pytest.approx(9), pytest.approx(9))
    assert result["settled_rms_x"] == pytest.approx(math.sqrt(4 * 9 / 6))
    assert result["settled_rms_y"] == pytest.approx(math.sqrt(3 * 16 / 6))
    assert result["settled_rms"] == pytest.approx(math.sqrt((4 * 9 + 3 * 16) / 6))
    assert (result["settled_max_x"], result["settled_max_y"]) == (pytest.approx(3), pytest.approx(4))
    never = measure(100, since_jump=0.1, tracking_error=(2e-3, 1e-3))
    assert all(np.isnan(value).all() for name, value in never.items() if name.startswith("settled"))
    assert (never["error_rms_x"], never["error_max_y"]) == (pytest.approx(2), pytest.approx(1))


SATURATED, TURNING = np.zeros((8, 4, 1)), np.zeros((6, 4, 1))
SATURATED[0, 3], SATURATED[1, 0], SATURATED[2, 1:3], SATURATED[3] = 1.0, -1.0, 1.0, 0.9999
TURNING[:, 0, 0] = [0.5, 0.7, 0.7, 0.6, 0.6, 0.9]  # up, still, down, still, up: turns twice, travels 0.6
TURNING[:, 1, 0] = [0, -1, 0, -1, 0, -1]  # turns four times, travels 5
STIFFNESS = over_time([[4400, 2000], [3600, 1900], [4000, 2000], [4000, 2000]])
LITRES = 0.5 * 1e-3 / NORMAL_DENSITY * 1000 * 60
"""Normal litres per minute of one gram per second for half of the time."""
KNOWN = {
    "to its setpoint": ({"pneumatic_stiffness": STIFFNESS}, {"pneumatic_rms_1": math.sqrt(50), "pneumatic_rms_2": 2.5}),
    **{f"period {period}": ({"period": period, "supply_flow": np.repeat([[1e-3], [0.0]], 250, axis=0)}, {"air": LITRES})
       for period in (0.001, 0.004)},
    "any valve at its limit": ({"command": SATURATED}, {"saturation": 100 * 3 / 8}),
    "the mean valve": ({"command": TURNING, "period": 0.01}, {"valve_turns": 6 / 4 / 0.06, "valve_travel": 5.6 / 4 / 0.06}),
}  # fmt: skip


@pytest.mark.parametrize(("signals", "expected"), KNOWN.values(), ids=KNOWN)
def test_stiffness_air_and_valves_have_the_figures_that_follow_by_hand(signals, expected):
    found = measure(max(len(one) for one in signals.values() if np.ndim(one)), **signals)
    assert {name: found[name] for name in expected} == {name: pytest.approx(value) for name, value in expected.items()}
    assert pytest.approx(23.2, abs=0.05) == LITRES


def test_a_lane_that_is_not_alive_is_left_as_it_is():
    rng = np.random.default_rng(0)
    signals = {
        "tracking_error": rng.normal(size=(900, 2, 2)),
        "since_jump": rng.uniform(0, 1, (900, 2)),
        "supply_flow": rng.uniform(0, 1, (900, 2)),
        "pneumatic_stiffness": rng.uniform(3000, 5000, (900, 2, 2)),
        "command": rng.uniform(-1.2, 1.2, (900, 4, 2)).clip(-1, 1),
    }
    # Lane 1 dies after 300 samples, lane 0 lives.
    alive = np.stack([np.ones(900, bool), np.arange(900) < 300], axis=1)
    both = measure(900, lanes=2, alive=alive, **signals)
    assert list(both) == list(UNITS)
    axis = {name: 2 if name == "command" else 1 for name in signals}
    whole = measure(900, **{name: values.take([0], axis[name]) for name, values in signals.items()})
    short = measure(300, **{name: values[:300].take([1], axis[name]) for name, values in signals.items()})
    for name in UNITS:
        np.testing.assert_array_equal(both[name], [whole[name][0], short[name][0]], err_msg=name)
    assert both["error_rms_x"][1] > 100


def hold(seconds, wobble):
    """Positions that leave 0.5 by ``wobble``(time) on x and by half of it on y, and the instants."""
    time = PERIOD * np.arange(round(seconds / PERIOD))
    x = wobble(time)
    return time, over_time(np.stack([0.5 + x, 0.5 * x], axis=1))


def test_hunting_is_peak_to_peak_where_all_has_been_constant_for_a_second():
    # Wild for the first 0.9 s, then +-0.4 mm.
    time, position = hold(3, lambda t: np.where(t < 0.9, 0.05, 0.4e-3) * np.sin(2 * np.pi * 5 * t))
    result = measure(len(time), position=position)
    assert result["hunting_x"] == pytest.approx(0.8, rel=5e-3)
    assert result["hunting_y"] == pytest.approx(0.4, rel=5e-3)


@pytest.mark.parametrize("name", ["target", "user_force", "stiffness_setpoint", "pneumatic_stiffness_setpoint"])
def test_a_change_of_anything_asked_for_starts_the_second_anew(name):
    # The signal steps at 1.5 s, the end effector jumps by 10 mm at 2.3 s: within the second after, so not hunting.
    time, position = hold(3.2, lambda t: np.where(t < 2.3, 0.0, 10e-3))
    later = np.array(RESTING[name]) * np.array([1, 1.5]) + np.array([0, 1.0])
    stepped = over_time(np.where(time[:, None] < 1.5, RESTING[name], later))
    quiet, calm = measure(len(time), position=position, **{name: stepped}), measure(len(time), position=position)
    assert quiet["hunting_x"] == 0
    assert calm["hunting_x"] == pytest.approx(10)


def test_hunting_takes_the_worst_window_and_never_spans_two():
    # Two quiet windows 5 mm apart, 0.2 mm and 0.6 mm wide; the push between them does not count.
    time, position = hold(5, lambda t: np.where(t < 2.5, 0.1e-3 * np.sin(40 * t), 5e-3 + 0.3e-3 * np.sin(40 * t)))
    force = over_time(np.where((time > 2.2)[:, None], (10.0, 0.0), (0.0, 0.0)))
    result = measure(len(time), position=position, user_force=force)
    assert result["hunting_x"] == pytest.approx(0.6, rel=1e-2)


def test_hunting_and_restarts_say_nothing_where_no_window_is_quiet():
    time, position = hold(3, lambda t: 1e-3 * np.sin(40 * t))
    moving = over_time(np.stack([0.5 + 0.01 * time, 0 * time], axis=1))
    result = measure(len(time), position=position, target=moving)
    for name in ("hunting_x", "hunting_y", "restarts", "stiffness_error", "cross_motion"):
        assert np.isnan(result[name]).all(), name
    assert np.isnan(measure(round(0.9 / PERIOD))["hunting_x"]).all()


def test_restarts_per_second_count_breaks_from_rest_with_a_dead_band():
    # From 1 s on, four bursts above 2 mm/s from below 0.5 mm/s; the dips to 1 mm/s within a burst are none.
    time = PERIOD * np.arange(round(5 / PERIOD))
    speed = np.zeros(len(time))
    for start in (0.2, 1.5, 2.3, 3.1, 3.9):
        speed[(time >= start) & (time < start + 0.3)] = 3e-3
        speed[(time >= start + 0.1) & (time < start + 0.2)] = 1e-3
    velocity = over_time(np.stack([0.6 * speed, -0.8 * speed], axis=1))
    result = measure(len(time), velocity=velocity)
    # The burst at 0.2 s lies before the window of 4 s.
    assert result["restarts"] == pytest.approx(4 / 4, rel=2e-3)
    assert measure(len(time), velocity=1.9e-3)["restarts"] == 0


def matrix(stiffness):
    """(Kx, Ky) or [[Kx, Kxy], [Kxy, Ky]] as the latter."""
    stiffness = np.asarray(stiffness, dtype=float)
    return np.diag(stiffness) if stiffness.ndim == 1 else stiffness


def spring(
    angle, push=20.0, rendered=(2000.0, 2000.0), asked=(2000.0, 2000.0), seconds=5.0, offset=(0.0, 0.0), wobble=None, rest=1.0
):
    """The stiffness test on a spring: nothing for ``rest`` s, a ramp of a second, then held; ``wobble``(time) on x and y."""
    time = PERIOD * np.arange(round(seconds / PERIOD))
    force = push * np.clip(time - rest, 0, 1)[:, None] * [math.cos(angle), math.sin(angle)]
    shift = np.array(offset) * (time > rest)[:, None] + (0 if wobble is None else wobble(time)[:, None])
    position = (0.45, 0.02) + force @ np.linalg.inv(matrix(rendered)) + shift
    target = np.array((0.452, 0.02))
    return measure(
        len(time),
        target=target,
        compliant_target=over_time(target + force @ np.linalg.inv(matrix(asked))),
        position=over_time(position),
        user_force=over_time(force),
        stiffness_setpoint=np.diag(matrix(asked)),
    )


COUPLED = ((3000.0, 800.0), (800.0, 1500.0))


@pytest.mark.parametrize("angle", [0, math.pi / 2, math.pi, -math.pi / 2, 0.7])
@pytest.mark.parametrize("seconds", [4.05, 9.0])
@pytest.mark.parametrize(
    ("rendered", "asked"),
    [
        *(((2000, 2000), (2000, 2000)), ((2500, 1000), (2500, 1000)), (COUPLED, COUPLED)),
        *(((2500, 1000), (2000, 2000)), ((1000, 4000), (1600, 1600)), ((3000, 1500), COUPLED)),
    ],
)
def test_stiffness_error_is_rendered_over_asked_less_one_and_cross_motion_not_asked_for(angle, seconds, rendered, asked):
    result = spring(angle, rendered=rendered, asked=asked, seconds=seconds)
    wanted, given = np.linalg.inv(matrix(asked)), np.linalg.inv(matrix(rendered))
    way, across = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    assert result["stiffness_error"] == pytest.approx(100 * ((way @ wanted @ way) / (way @ given @ way) - 1), abs=0.02)
    assert result["cross_motion"] == pytest.approx(1e3 * 20 * abs(across @ (given - wanted) @ way), rel=1e-3, abs=1e-3)


LONG = {"rest": 2.0, "seconds": 6.0}


@pytest.mark.parametrize(
    ("options", "error", "cross"),
    [
        ({"offset": (0.0, 1.5e-3)}, 0, 1.5),
        # 4 Hz, two whole periods in the window, and at its peak as the push begins: 0.5 mm of 10 would be 5 %.
        ({"wobble": lambda t: 0.5e-3 * np.cos(2 * np.pi * 4 * t)}, 0, 0),
        # 1 mm of drift that is over half a second before the push, and one that is over before the last half second.
        ({**LONG, "wobble": lambda t: np.where(t < 2.0 - WINDOW, 1e-3, 0.0)}, 0, 0),
        ({"seconds": 6.0, "wobble": lambda t: np.where((t > 1.5) & (t < 6.0 - WINDOW - PERIOD), 1e-3, 0.0)}, 0, 0),
        # Half of the window before the push: a start 0.5 mm off shows as 10 mm of push over 9.5 mm.
        ({**LONG, "wobble": lambda t: np.where(t < 2.0 - WINDOW / 2, 1e-3, 0.0)}, 100 * (10 / 9.5 - 1), 0.5),
    ],
    ids=["offset", "hunting", "early", "late", "inside"],
)
def test_displacement_is_from_the_mean_before_the_push_to_the_mean_of_the_last_of_the_hold(options, error, cross):
    result = spring(0, **options)
    assert result["stiffness_error"] == pytest.approx(error, rel=0.02, abs=0.02)
    assert result["cross_motion"] == pytest.approx(cross, rel=0.02, abs=2e-3)


def test_unrest_is_the_motion_of_the_half_second_before_the_push():
    # x and y both move: the diagonal of two spans. A jump before the window and the way under the push do not count.
    moved = spring(0, rest=2.0, seconds=6.0, wobble=lambda t: 3e-3 * (t < 1.2) + 4e-4 * (t < 1.8))
    assert moved["unrest"] == pytest.approx(0.4 * math.sqrt(2), rel=1e-6)
    assert spring(0, rest=2.0, seconds=6.0)["unrest"] == pytest.approx(0, abs=1e-9)
    assert np.isnan(spring(0, push=0)["unrest"]).all()


@pytest.mark.parametrize("again", [3.2, 5.0])
def test_every_push_is_measured_from_the_rest_before_it_be_it_ever_so_short(again):
    time = PERIOD * np.arange(round(9 / PERIOD))
    # Pushed from 1 s to 3 s, left 4 mm further on, and pushed again.
    force = 20 * np.where(time < 3, np.clip(time - 1, 0, 1), np.clip(time - again, 0, 1))[:, None] * [1.0, 0.0]
    position = (0.5, 0.0) + force / 2500 + np.where(time >= 3, 4e-3, 0.0)[:, None]
    assert measure(len(time), position=over_time(position), user_force=over_time(force))["stiffness_error"] == pytest.approx(25)


def along_x(force):
    return over_time(np.stack([force, 0 * force], axis=1))


TIME = PERIOD * np.arange(round(5 / PERIOD))
RAMP = along_x(20 * np.clip(TIME - 1, 0, 1))


@pytest.mark.parametrize(
    "signals",
    [
        {"user_force": RAMP[: round(3.9 / PERIOD)]},
        {"user_force": 0 * RAMP},
        {"user_force": along_x(20 + np.clip(TIME - 1, 0, 1))},
        {"user_force": RAMP, "target": over_time(np.where((TIME < 0.5)[:, None], (0.5, 0.0), (0.501, 0.0)))},
        {"user_force": RAMP, "stiffness_setpoint": over_time(np.where((TIME < 0.5)[:, None], 2000.0, (2000.0, 3000.0)))},
    ],
    ids=["too short", "no push", "no rest before it", "a target that moved", "a setpoint that changed"],
)
def test_rendered_stiffness_needs_a_push_held_for_two_seconds_and_a_resting_reference(signals):
    result = measure(len(signals["user_force"]), **signals)
    assert np.isnan(result["stiffness_error"]).all()
    assert np.isnan(result["cross_motion"]).all()


@pytest.mark.parametrize(("begins", "dies", "error"), [(1.4, 0.4, math.nan), (1.0, 4.5, 25.0)])
def test_a_lane_that_died_has_the_figures_of_the_pushes_before(begins, dies, error):
    """Lost after 0.4 s, it runs a new episode that is pushed in its turn."""
    force = 20 * np.clip(TIME - begins, 0, 1)[:, None, None] * [1.0, 0.0]
    result = measure(len(TIME), position=(0.5, 0.0) + force / 2500, user_force=force, alive=(dies > TIME)[:, None])
    assert result["stiffness_error"] == pytest.approx(error, abs=0.05, nan_ok=True)
    assert result["cross_motion"] == pytest.approx(0 * error, abs=1e-6, nan_ok=True)
