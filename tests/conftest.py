"""What several tests share: property tests that repeat themselves and may take their time, and one short training."""

import pytest
from hypothesis import settings

from tests.console import run

# The same examples every time, and as long as a busy machine needs.
settings.register_profile("birthsim", deadline=None, derandomize=True, database=None)
settings.load_profile("birthsim")

SMALL = """[training]
environment = "BirthSIM/ProbeResidual-v0"
lanes = 32
rollout = 32
batch = 256
epochs = 4
learning_rate = 2e-3
hidden = [32, 32]
validation_lanes = 4
validations = 2
"""


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A configuration whose trainings take seconds."""
    path = tmp_path_factory.mktemp("configurations") / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="session")
def trained(tmp_path_factory, small):
    """A folder of birthsim-train, and the process that made it."""
    folder = tmp_path_factory.mktemp("policies") / "deeper" / "policy"
    return folder, run("train", "--config", small, "--steps", 30_000, "--seed", 3, "--authority", 60, "--out", folder)
