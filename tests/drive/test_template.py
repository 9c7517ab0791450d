"""The template of a driver for analogue inputs and outputs, on a card that is imitated."""

import sys
import types

import numpy as np
import pytest

from birthsim_drive.driver import make_driver
from birthsim_drive.loop.control import Loop
from birthsim_drive.loop.record import Period, Record
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import needs_of
from birthsim_env.physics.rig.parameters import Parameters
from tests.console import ROOT

RAIL = Parameters.from_dict({"linkage": {"kind": "rail", "inclination": 0.3}})


class Task:
    """A card that reads 2 and 3 V of pressure, mid stroke and no force, and keeps what is written."""

    written, closed = [], 0

    def __init__(self):
        self.ai_channels = self.ao_channels = self

    def add_ai_voltage_chan(self, name, **limits):
        assert name.count("ai") == 1

    add_ao_voltage_chan = lambda self, name, **limits: None  # noqa: E731

    def read(self):
        return [2.0, 3.0, 5.0, 5.0]

    def write(self, value):
        assert 0.0 <= value <= 10.0
        self.written.append(value)

    def close(self):
        Task.closed += 1


@pytest.fixture
def bench(monkeypatch):
    module = types.ModuleType("nidaqmx")
    module.Task = Task
    monkeypatch.setitem(sys.modules, "nidaqmx", module)
    Task.written, Task.closed = [], 0
    return make_driver(f"{ROOT / 'examples' / 'bench_nidaqmx.py'}:Bench", RAIL)


def test_volts_become_what_they_measure(bench):
    seen = bench.read()
    assert seen.pressures[2:].tolist() == pytest.approx([3.013e5, 4.013e5])
    assert np.hypot(*seen.position) == pytest.approx(RAIL.geometry.k2)
    assert np.arctan2(*seen.position[::-1]) == pytest.approx(0.3)
    assert np.hypot(*seen.user_force) == pytest.approx(0.0, abs=1e-9)
    bench.write(np.array([0.0, 0.0, 0.4, -0.4]))
    assert Task.written[-1] == pytest.approx(7.0)
    bench.stop()
    bench.stop()  # which may happen
    assert Task.written[-1] == 5.0
    assert Task.closed == 2


def test_it_is_driven_and_its_valve_ends_shut(bench, tmp_path):
    class Open:
        def command(self, measurement, reference):
            return np.array([[0.0], [0.0], [0.1], [-0.1]])

        def reset(self, lanes=None):
            pass

    law, record = Open(), Record.make(tmp_path / "periods", 3000)
    limits = Limits(late_periods=1e9, leap=1e9).for_rig(RAIL)
    loop = Loop(law, None, bench, limits, RAIL, record, needs_of(law), duration=0.05, ramp=0.0)
    loop.run()
    assert loop.faults == []
    assert Task.written[-1] == 5.0
    assert max(Task.written) == pytest.approx(5.5)
    assert record.kept[Period.has_sample.first].all()
