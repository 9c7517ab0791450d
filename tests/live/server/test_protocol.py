"""What comes in over the socket: every message either means something or is refused by a sentence."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.settings import STIFFNESSES, Choices, combined, default_settings, merged
from birthsim_live.server import protocol
from birthsim_live.server.protocol import parse

CHOICES = Choices(Parameters())
SETPOINTS = dict(zip(STIFFNESSES, (1500.0, 2500.0, 4000.0, 2000.0), strict=True))

GOOD = [
    ({"type": "drag", "position": [0.5, -1], "id": 3}, protocol.Drag(position=(0.5, -1.0), id=3)),
    ({"type": "push", "force": [0, -20.5], "id": 4}, protocol.Push(force=(0.0, -20.5), id=4)),
    ({"type": "release"}, protocol.Release()),
    ({"type": "set", "settings": {"Kclx": 3}}, protocol.Set(settings={"Kclx": 3})),
    ({"type": "pause", "paused": True}, protocol.Pause(paused=True)),
    ({"type": "speed", "speed": 1}, protocol.Speed(speed=1.0)),
    ({"type": "reset"}, protocol.Reset()),
    ({"type": "record", "on": False}, protocol.Record(on=False)),
    ({"type": "seek", "time": 1.5}, protocol.Seek(time=1.5)),
    ({"type": "ping", "id": 7}, protocol.Ping(id=7)),
]

BAD = [
    (b"{}", "binary"),
    ("", "no JSON"),
    ("{", "no JSON"),
    ("[1]", r"message = \[1\]"),
    ("{}", "no known type; allowed: drag, push, release"),
    ('{"type":"drop"}', "no known type"),
    ('{"type":["drag"]}', "no known type"),
    ('{"type":"drag","position":[0,NaN],"id":1}', "position.1 = nan; allowed: -10 to 10 m"),
    ('{"type":"drag","position":[0,-Infinity],"id":1}', "position.1 = -inf"),
    ('{"type":"drag","position":[0,1e999],"id":1}', "position.1 = inf"),
    ('{"type":"drag","position":[0,1' + 4000 * "0" + '],"id":1}', r"position.1 = 1000*\.\.\.; allowed: -10 to 10 m"),
    ('{"type":"drag","position":[0,1' + 9000 * "0" + '],"id":1}', "no JSON"),
    ('{"type":"push","force":[0,101],"id":1}', "push.force.1 = 101; allowed: -100 to 100 N"),
    ('{"type":"drag","position":[0],"id":1}', "drag.position.1 is missing"),
    ('{"type":"drag","position":[0,true],"id":1}', "position.1 = True; allowed: -10 to 10 m"),
    ('{"type":"drag","position":[0,0],"id":-1}', "drag.id = -1; allowed: greater than or equal to 0"),
    ('{"type":"drag","position":[0,0]}', "drag.id is missing"),
    ('{"type":"reset","now":1}', "reset.now is unknown; allowed: without it"),
    ('{"type":"set","settings":[]}', r"set.settings = \[\]"),
    ('{"type":"pause","paused":1}', "pause.paused = 1; allowed: true, false"),
    ('{"type":"speed","speed":0.01}', "speed.speed = 0.01; allowed: 0.05 to 1 times real time"),
    ('{"type":"ping","id":"' + 100 * "a" + '"}', "allowed: a valid integer"),
    ('{"type":"ping","id":"' + protocol.LONGEST * "a" + '"}', f"allowed: up to {protocol.LONGEST}"),
    ('{"type":"set","settings":' + 4000 * "[" + 4000 * "]" + "}", "."),
]


@pytest.mark.parametrize(("content", "message"), GOOD, ids=lambda value: value["type"] if isinstance(value, dict) else "")
def test_messages_are_understood(content: dict[str, Any], message: protocol.Message) -> None:
    assert parse(json.dumps(content)) == message


@pytest.mark.parametrize(("text", "words"), BAD, ids=[str(text)[:24] for text, _ in BAD])
def test_what_is_wrong_is_named(text: str | bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        parse(text)
    assert len(str(caught.value)) < 400


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@given(st.text(max_size=200) | st.binary(max_size=50))
def test_any_text_is_a_message_or_refused(text: str | bytes) -> None:
    understood(text)


@given(st.sampled_from([content for content, _ in GOOD]), st.data())
def test_messages_with_any_fields_are_understood_or_refused(content: dict[str, Any], data: st.DataObject) -> None:
    changed = dict(content)
    for name in data.draw(st.lists(st.sampled_from([*content, "other"]), max_size=2)):
        changed[name] = data.draw(json_values)
    understood(json.dumps(changed))


@given(st.dictionaries(st.sampled_from([*CHOICES.sliders, *CHOICES.words, "scenario_force", "other"]), json_values, max_size=4))
def test_settings_with_any_values_are_right_or_refused(changes: dict[str, Any]) -> None:
    try:
        merged(default_settings(Parameters()), CHOICES.checked(changes), SETPOINTS)
    except ValueError as error:
        assert "allowed" in str(error)  # noqa: PT017  both ways are right


def understood(text: str | bytes) -> None:
    try:
        message = parse(text)
    except ValueError as error:
        assert "allowed" in str(error) or "no JSON" in str(error)  # noqa: PT017  both ways are right
    else:
        assert isinstance(message, protocol.Message)
        if isinstance(message, protocol.Drag):
            assert all(math.isfinite(x) for x in message.position)


def test_what_goes_out_is_strict_json() -> None:
    text = protocol.encode({"a": math.nan, "b": [math.inf, 1.5], "c": {"d": -math.inf}})
    assert text == '{"a":null,"b":[null,1.5],"c":{"d":null}}'


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"Kclx": 100}, "Kclx = 100; allowed: 200 to 8000 N/m"),
        ({"Kclx": math.nan}, "Kclx = nan"),
        ({"Kclx": "2000"}, "Kclx = '2000'"),
        ({"Kclx": True}, "Kclx = True"),
        ({"friction": ""}, "friction = ''; allowed: 0 to 2"),
        ({"friction": None}, "friction = None; allowed: 0 to 2"),
        ({"scenario_force": "yes"}, "scenario_force = 'yes'; allowed: true, false"),
        ({"damping_applies": True}, "damping_applies is unknown; allowed: scenario"),
        ({"scenario": "zebra"}, "scenario = 'zebra'; allowed: circle, probe"),
        ({"scenario": ["probe"]}, r"scenario = \['probe'\]"),
        ({"scenario_force": 1}, "scenario_force = 1; allowed: true, false"),
        ({"controller": "residual"}, "controller = 'residual'"),
        ({"valves": "three"}, "valves = 'three'; allowed: two_valves, one_valve"),
    ],
)
def test_settings_are_refused_by_name(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        CHOICES.checked(changes)


def test_what_is_not_installed_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    choices = Choices(Parameters())
    missing = {choice["name"]: choice.get("missing") for choice in choices.controllers}
    assert missing["nonlinear-mpc"] == "pip install 'birthsim[mpc]'"
    with pytest.raises(ValueError, match=r"'nonlinear-mpc'; allowed: after pip install 'birthsim\[mpc\]'"):
        choices.checked({"controller": "nonlinear-mpc"})


change = st.fixed_dictionaries(
    {},
    optional={
        "scenario": st.sampled_from(["circle", "probe"]),
        "stiffness_source": st.sampled_from(["scenario", "sliders"]),
        "Kclx": st.sampled_from([300.0, 4000.0]),
        "Kpneu1": st.sampled_from([3000.0]),
        "mass": st.sampled_from([2.0, 5.0]),
    },
).filter(lambda one: not (one.get("stiffness_source") == "scenario" and ({"Kclx", "Kpneu1"} & set(one))))


@given(st.lists(change, min_size=1, max_size=5))
def test_a_flood_of_changes_at_once_is_the_changes_one_by_one(changes: list[dict[str, Any]]) -> None:
    one_by_one, pending = default_settings(Parameters()), {}
    for each in changes:
        one_by_one = merged(one_by_one, each, SETPOINTS)
        pending = combined(pending, each)
    at_once = merged(default_settings(Parameters()), pending, SETPOINTS)
    assert at_once.stiffness_source == one_by_one.stiffness_source
    assert (at_once.scenario, at_once.mass) == (one_by_one.scenario, one_by_one.mass)
    if at_once.stiffness_source == "sliders":
        assert at_once == one_by_one
