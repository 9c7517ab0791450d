"""One cylinder on a rail in C: the bits of Python, and nothing of the idle cylinder to set."""

import json
import math

import numpy as np
import pytest

from baselines.named import make_controller
from birthsim_build.building import build_c
from birthsim_build.bundle import loop_name, make_bundle
from birthsim_build.code.targets import HOST
from birthsim_build.derived_parameters import parameter_names
from birthsim_build.estimate import estimates
from birthsim_env import Parameters, Reference
from birthsim_env.loop.rows import ASKED, REFERENCE, WORLD, measurement_of
from lab.studies.targets.reference import SHARED, as_inputs, loop_rows, whole_rows
from lab.studies.targets.running import ROW, library_rows
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


def test_a_law_alone_knows_the_idle_cylinder_that_nobody_measures(tmp_path):
    """Its estimator reads the pressures of both; sensors show those of the idle one. Cycles are counted on a rail too."""
    need_linker()
    if HOST is None:
        pytest.skip("no shared library runs here; allowed: Linux on x86-64 or aarch64")
    bundle = make_bundle(RIG, [], ["encoders"], ["abry"], alone=True)
    (tmp_path / "build.json").write_text(json.dumps(build_c(bundle, HOST, tmp_path)))
    rows = whole_rows("rail-steps", "encoders", "abry", PERIODS, rig=RIG, parameters=RIG)
    idle = ("measured_Pp1", "measured_Pn1")
    law, openings = make_controller("abry", RIG), np.empty((PERIODS, 4))
    for own, seen in zip(openings, rows[:, WORLD : WORLD + ASKED, None], strict=False):
        own[:] = law.command(measurement_of(seen, True, False), Reference(seen[REFERENCE:].copy()))[:, 0]
    told = {name: values for name, values in as_inputs(rows[:-1, WORLD:]).items() if name not in idle}
    said = library_rows(tmp_path, "law_abry_sampled", PERIODS, told)[:, ROW["opening_P1"] :][:, :4]
    assert_same_bits(said, openings)
    assert estimates(bundle)["law_abry_sampled"]["operations"] > 1000


def test_an_fmu_of_a_rail_has_no_parameters_of_the_idle_cylinder():
    every, own = parameter_names(Parameters()), parameter_names(RIG)
    assert [name for name in every if name not in own] == [name for name in every if name.startswith("cylinder1.")]
