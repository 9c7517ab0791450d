"""The study of measured data: it finds what synthetic data were made of, and keeps no path of a user's."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from baselines.identification.valve_table import parts_of
from lab.engine import shelf
from lab.studies.validation import seals, study, tables, valve

TRUE = np.array([3.0, 0.7, 1.3, 0.01, 3e4, 40.0])
OFFSET = 5.0


def write_seals(data, seal="PK", seconds=8.0):
    """Logs of strokes at +-10 mm/s whose friction is ``TRUE`` LuGre's, behind an offset of the load cell."""
    (data / seals.FOLDER).mkdir(exist_ok=True)
    time = np.arange(0, seconds, seals.PERIOD)
    speed = 0.01 * np.sin(2 * np.pi * time / 4.0)
    place = -0.01 * 4.0 / (2 * np.pi) * np.cos(2 * np.pi * time / 4.0)
    for bar in seals.BARS:
        found = seals.driven(np.stack([speed, np.full_like(time, bar), time]), TRUE)
        force = 1e5 * seals.AREA * bar + found + OFFSET
        rows = np.column_stack([1e3 * time, 1e3 * place, np.full_like(time, bar), force])
        head = "time_ms,laser_mm,pressure_bar_gauge,force_N"
        np.savetxt(seals.file_of(data, seal, bar), rows, "%.5f", ",", header=head, comments="")


def write_valve(data, overlap=0.08, curvature=0.3):
    volts = np.linspace(5, 10, 41)
    flow = 80.0 * parts_of((volts - 5) / 5, overlap, curvature)
    (data / valve.FILE).parent.mkdir()
    head = "Voltage (volt),Exp. Vol. flow rate (l/min)"
    np.savetxt(data / valve.FILE, np.column_stack([volts, flow]), "%.6f", ",", header=head, comments="")


def test_the_level_and_its_growth_with_pressure_are_found(tmp_path):
    write_seals(tmp_path)
    moved = [seals.motion(seals.file_of(tmp_path, "PK", bar)) for bar in seals.BARS]
    numbers = seals.fitted(moved, True)
    # What the filter that gives speed smooths is made up for by bristles and viscous friction: some 5 % of the level.
    assert numbers[:2] == pytest.approx(TRUE[:2], abs=0.05 * (TRUE[0] + TRUE[1] * 7))

    def rms(model):
        # In the log the bristle is bent when the model begins with a straight one: a second lets that decay.
        return np.sqrt(np.mean(np.concatenate([one[100:] for one in seals.errors(model, moved)]) ** 2))

    # The filter that gives speed misses what happens within its 0.11 s at a reversal: some 2 % of 8 N.
    assert rms(numbers) < 0.02 * 8
    assert rms(seals.fitted(moved, False)) > 0.7
    grown = np.diff([seals.level(one) for one in moved]) / np.diff(seals.BARS)
    assert np.all((grown > TRUE[1]) & (grown < TRUE[2] * TRUE[1])), "half the difference of both directions has no offset"


def test_a_driven_piston_has_the_friction_of_lugres_equations():
    time = np.arange(0, 1.0, seals.PERIOD)
    moved = np.stack([0.014 * np.sin(2 * np.pi * time), 1.0 + time, np.zeros_like(time)])
    found = seals.driven(moved, TRUE)
    f0, per_bar, ratio, stribeck, stiffness, viscous = TRUE
    deflection, expected = 0.0, []
    for speed, pressure, _ in moved.T:
        coulomb = f0 + per_bar * pressure
        steady = (coulomb + (ratio - 1) * coulomb / (1 + (speed / stribeck) ** 2)) / stiffness
        # The speed is constant for a sample, so that the bristle nears its steady bend exponentially.
        wear = np.exp(-abs(speed) / steady * seals.PERIOD)
        end = steady * np.sign(speed)
        deflection = end + (deflection - end) * wear
        rate = speed - abs(speed) / steady * deflection
        expected.append(stiffness * deflection + seals.DAMPING * rate + viscous * speed)
    # Euler's steps of 0.5 ms miss an exponential of at most 130 1/s by some 1.5 % of the 8 N while it decays.
    assert found == pytest.approx(np.array(expected), abs=0.015 * 8)


def test_the_characteristic_of_a_table_is_found(tmp_path):
    write_valve(tmp_path)
    found = valve.measure(str(tmp_path), {})
    assert (found["overlap"], found["curvature"]) == pytest.approx((0.08, 0.3), abs=1e-5)
    assert found["largest"] < 1e-5 < found["linear"]


def test_what_is_there_is_measured_and_what_is_not_is_left_out(tmp_path):
    write_valve(tmp_path)
    assert list(study._tasks(SimpleNamespace(data=str(tmp_path)))) == [("valve", "")]
    write_seals(tmp_path)
    assert list(study._tasks(SimpleNamespace(data=str(tmp_path)))) == [("seals", "PK"), ("valve", "")]
    seals.file_of(tmp_path, "PK", 3).unlink()
    assert list(study._tasks(SimpleNamespace(data=str(tmp_path)))) == [("valve", "")]


def test_other_data_are_measured_anew(tmp_path):
    write_valve(tmp_path)
    first = study._tasks(SimpleNamespace(data=str(tmp_path)))["valve", ""].file()
    (tmp_path / valve.FILE).write_text((tmp_path / valve.FILE).read_text() + "\n")
    assert study._tasks(SimpleNamespace(data=str(tmp_path)))["valve", ""].file() != first


@pytest.mark.parametrize("data", ["", "nowhere"])
def test_a_folder_without_data_is_refused(data, tmp_path):
    with pytest.raises(ValueError, match=r"--data = .*; allowed: .*piston_friction/"):
        study._tasks(SimpleNamespace(data=str(tmp_path / data) if data else ""))


def test_no_path_is_kept_and_renewal_leaves_it_to_who_has_the_data(monkeypatch, capsys):
    assert study.STUDY.kept_settings({"data": "/home/somebody"}) == {}
    monkeypatch.setattr(shelf, "names", lambda: ["validation"])
    monkeypatch.setattr(shelf, "state", lambda name: "stale")
    monkeypatch.setattr(shelf.subprocess, "run", lambda *_, **__: pytest.fail("ran without data"))
    shelf.renew()
    assert "validation --data FOLDER" in capsys.readouterr().out


def test_tables_have_every_seal_and_both_characteristics():
    numbers = dict(zip(seals.NAMES, TRUE, strict=True))
    model = {
        "own": [0.1] * 4,
        "one_level": [1.0, 2.0] * 2,
        "foretold": [0.4] * 4,
        "by_pressure": [0.3] * 4,
        "parameters": numbers,
    }
    found = {
        "seals": {"PK": {"levels": [1.0, 2.0, 3.0, 4.0], "models": dict.fromkeys(seals.LAWS, model)}},
        "valve": {"overlap": 0.1, "curvature": 0.4, "largest": 0.0175, "linear": 0.09},
    }
    text = tables.tables(json.loads(json.dumps(found)))
    assert "| PK | 1.0 | 2.0 | 3.0 | 4.0 |" in text["seals"]
    assert "| PK | LuGre | 1.00 to 2.00 | 0.30 to 0.30 |" in text["seals"]
    assert "0.100 | 0.400 | 1.8 |" in text["valve"]
