"""Another distribution's controller: one file, and one entry point of the group ``birthsim.plugins`` that names it."""

import sys
from pathlib import Path

import numpy as np
import pytest

from agents.policy.shipped import SHIPPED
from baselines.bench.evaluation import evaluate
from baselines.named import compiled_names, known_options, make_controller, uses_force
from birthsim_env import Parameters
from birthsim_env.registry import names, register
from tests.console import call
from tests.registered import with_plugins

PLUGINS = Path(__file__).parent / "plugins"
RIG = Parameters()


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    """The plugin, as if its distribution were installed."""
    monkeypatch.syspath_prepend(PLUGINS)
    monkeypatch.delitem(sys.modules, "controller", raising=False)
    with_plugins(monkeypatch, "controller")


def test_it_is_listed_evaluated_and_asked_about(monkeypatch, capsys):
    assert {"proportional", "proportional-python"} <= {*names("controller")}
    assert "proportional" in compiled_names()
    assert "proportional-python" not in compiled_names()
    laws = [make_controller(name, RIG) for name in ("proportional", "proportional-python")]
    traces = [evaluate("BirthSIM/Probe-v3", law, "", 1, 0, progress=False, duration=0.1).traces[0] for law in laws]
    np.testing.assert_array_equal(*traces)
    with pytest.raises(ValueError, match=r"did you mean 'proportional'"):
        make_controller("proportionel", RIG)
    _, printed, _ = call("run", monkeypatch, capsys, "--help")
    assert "proportional" in printed.split("controllers: ")[1]


def test_what_it_needs_and_takes_is_known():
    assert not uses_force("proportional")
    assert uses_force("proportional-python")
    assert known_options("proportional") == ["gain", "on_fault", "fault_time"]
    assert make_controller("proportional[gain=3]", RIG).gain == 3.0
    assert uses_force("limited:proportional")


def test_its_policy_is_one_of_those_there_are():
    register(policy="theirs", about="A policy of theirs.", needs={"extra agents"})(SHIPPED / "circle_honest_student")
    assert "theirs" in names("policy")
    assert not make_controller("residual:theirs", RIG).settings.force_sensor
    assert not uses_force("residual:theirs")


def test_what_it_lacks_is_named_with_the_extra_that_has_it():
    @register(controller="lacking", about="Needs what is not there.", needs={"extra agents"})
    def lacking(parameters):
        import nothing_of_this_name

        return nothing_of_this_name

    with pytest.raises(ValueError, match=r"nothing_of_this_name.*lacking needs .*\[agents\]"):
        make_controller("lacking", RIG)
