"""Physics and law are pinned to stored trajectories; ``make golden`` makes them anew."""

from __future__ import annotations

import numpy as np
import pytest

from tests.golden import make


@pytest.fixture(scope="module")
def stored() -> dict[str, np.ndarray]:
    with np.load(make.FILE) as file:
        return dict(file)


def test_stored_for_this_rig(stored):
    assert str(stored["fingerprint"]) == make.fingerprint(), "the default rig has changed: run make golden and say why"


@pytest.mark.parametrize("law", ["lugre", "coulomb"])
def test_plant(stored, law):
    np.testing.assert_allclose(make.plant_run(law), stored[f"plant_{law}"], rtol=1e-8, atol=1e-11)


def test_law_on_circle(stored):
    # The loop amplifies rounding where it hunts; a micrometre and a few pascals are far below any change of the physics.
    run = make.circle_run()
    np.testing.assert_allclose(run[:, :2], stored["circle"][:, :2], atol=1e-6)
    np.testing.assert_allclose(run[:, 2:], stored["circle"][:, 2:], rtol=1e-4)
