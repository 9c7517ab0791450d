"""One cylinder on a rail in C: the bits of Python, and nothing of the idle cylinder to set."""

import json
import math

import pytest

from birthsim_build.building import build_c
from birthsim_build.bundle import loop_name, make_bundle
from birthsim_build.code.targets import HOST
from birthsim_build.fmu.derived_parameters import parameter_names
from birthsim_env import Parameters
from lab.studies.targets.reference import SHARED, loop_rows
from lab.studies.targets.running import library_rows
from tests.build.targets import assert_same_bits, need_linker

RIG = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": math.radians(30.0)})
PERIODS = 1500


@pytest.mark.parametrize(
    ("scenario", "sensors", "law"),
    [
        ("rail", "ideal", "pid"),
        ("rail", "encoders", "pid"),
        ("rail-steps", "encoders", "abry"),
        ("rail-stiffness", "ideal", "abry-one-valve"),
    ],
)
def test_a_closed_loop_on_a_rail(scenario, sensors, law, tmp_path):
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    report = build_c(make_bundle(RIG, [scenario], [sensors], [law]), HOST, tmp_path)
    (tmp_path / "build.json").write_text(json.dumps(report))
    rows = library_rows(tmp_path, loop_name(scenario, sensors, law), PERIODS)
    assert_same_bits(rows[:, SHARED], loop_rows(scenario, sensors, law, PERIODS, rig=RIG, parameters=RIG)[:, SHARED])


def test_an_fmu_of_a_rail_has_no_parameters_of_the_idle_cylinder():
    every, own = parameter_names(Parameters()), parameter_names(RIG)
    assert [name for name in every if name not in own] == [name for name in every if name.startswith("cylinder1.")]
