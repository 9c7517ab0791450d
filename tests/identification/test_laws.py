"""Which friction law a log supports: scores of windows that guided no fit, and logs of rigs with each law."""

import math
from typing import get_args, get_type_hints

import numpy as np
import pytest

from baselines.backstepping.controller import BacksteppingController
from baselines.identification.experiment import propose
from baselines.identification.fit.estimate import Fit
from baselines.identification.fit.free_parameters import FREE_PARAMETERS
from baselines.identification.fit.laws import LAWS, chances_of, scores_of
from baselines.identification.identified import Identified, identify
from baselines.identification.laboratory import run_plan
from baselines.identification.windows.starts import Noise
from baselines.named import make_controller
from birthsim.commands.identify import Settings
from birthsim_env.physics.rig.parameters import Parameters, value_of
from lab.studies.strangers.model import Strangeness
from lab.studies.strangers.tasks import strange
from tests.identification.trials import OWNER, TRUE

WINDOWS, ROWS, STARTS, COUNT = 12, 30, 4, 3


class Linear:
    """A problem whose residuals are a straight line: measured less slopes @ theta less starts @ (a window's own state)."""

    def __init__(self, measured: np.ndarray, slopes: np.ndarray, starts: np.ndarray) -> None:
        # Start states with a prior of their own, as rows beneath; eliminated by an orthonormal basis of what they explain.
        tall = np.concatenate([starts, np.broadcast_to(np.eye(STARTS), (len(starts), STARTS, STARTS))], axis=1)
        basis, triangle = np.linalg.qr(tall)
        self.slopes = type("Slopes", (), {"triangle": triangle * np.sign(np.diagonal(triangle, axis1=1, axis2=2))[..., None]})
        self._measured, self._rows = self._left(basis, measured[..., None])[..., 0], self._left(basis, slopes)
        self.derivatives = -self._rows
        self.spread = np.ones(COUNT)

    @staticmethod
    def _left(basis: np.ndarray, columns: np.ndarray) -> np.ndarray:
        below = np.zeros((len(columns), STARTS, columns.shape[2]))
        every = np.concatenate([columns, below], axis=1)
        return np.asarray(every - basis @ (basis.transpose(0, 2, 1) @ every))

    def settled(self, theta: np.ndarray) -> tuple[None, np.ndarray]:
        return None, self._measured - self._rows @ theta

    def residuals(self, theta: np.ndarray) -> np.ndarray:
        return np.concatenate([self.settled(theta)[1].ravel(), theta])

    def fit(self, theta: np.ndarray) -> Fit:
        jacobian = np.concatenate([self.derivatives.reshape(-1, COUNT), np.eye(COUNT)])
        return Fit(FREE_PARAMETERS[:COUNT], theta, Parameters(), self, jacobian, Noise(1.0, 1.0), 0.0)  # type: ignore[arg-type]


def test_a_windows_score_is_its_likelihood_under_a_fit_of_all_others() -> None:
    """Against ridge regressions of the other windows and the density of a normal vector, from wherever the fit stands."""
    rng = np.random.default_rng(4)
    slopes, starts = rng.normal(size=(WINDOWS, ROWS, COUNT)), 2.0 * rng.normal(size=(WINDOWS, ROWS, STARTS))
    measured = rng.normal(size=(WINDOWS, ROWS)) + slopes @ np.array([1.0, -2.0, 0.5])
    measured += np.einsum("wrs,ws->wr", starts, rng.normal(size=(WINDOWS, STARTS)))
    found = scores_of(Linear(measured, slopes, starts).fit(np.array([0.3, 0.0, -1.0])))
    spreads = np.eye(ROWS) + starts @ starts.transpose(0, 2, 1)
    for w in range(WINDOWS):
        others = [k for k in range(WINDOWS) if k != w]
        weights = np.linalg.inv(spreads[others])
        normal = np.eye(COUNT) + np.einsum("wrq,wrs,wsp->qp", slopes[others], weights, slopes[others])
        theta = np.linalg.solve(normal, np.einsum("wrq,wrs,ws->q", slopes[others], weights, measured[others]))
        left = measured[w] - slopes[w] @ theta
        density = -0.5 * left @ np.linalg.solve(spreads[w], left) - 0.5 * np.linalg.slogdet(spreads[w])[1]
        assert found[w] == pytest.approx(density, rel=1e-9)


@pytest.mark.parametrize("sure", [0.0, 1.0, 2.0])
def test_the_probability_is_that_of_a_mean_over_its_standard_deviation(sure: float) -> None:
    """Of many windows the bootstrap of the mean is normal."""
    count = 400
    scatter = np.random.default_rng(1).normal(size=count)
    scatter = (scatter - scatter.mean()) / scatter.std()
    better = sure / math.sqrt(count) + scatter
    found = chances_of(np.stack([np.zeros(count), better, np.full(count, -9.0)]), 0)
    assert found[1] == pytest.approx(0.5 * (1.0 + math.erf(sure / math.sqrt(2.0))), abs=0.02)
    assert found[2] == 0.0
    assert found.sum() == pytest.approx(1.0)


def test_the_command_takes_every_law() -> None:
    assert set(get_args(get_args(get_type_hints(Settings)["friction_law"])[0])) == set(LAWS)


def found_of(law: str, friction_law: str | None = None) -> Identified:
    log = run_plan(
        propose(OWNER, 5.0, 5), [TRUE.replace({"friction.law": law})], make_controller("backstepping", OWNER), "lab", 8
    )
    return identify(log[0], OWNER, 0, friction_law=friction_law)


@pytest.mark.slow
@pytest.mark.parametrize(
    "law", ["elasto_plastic", *(pytest.param(name, marks=pytest.mark.weekly) for name in ("lugre", "coulomb"))]
)
def test_the_law_of_the_rig_is_chosen_and_its_friction_found(law: str) -> None:
    found = found_of(law)
    assert found.rig.friction.law == found.laws.chosen == law
    assert found.laws.chances[law] > 0.99
    assert value_of(found.rig, "cylinder1.coulomb_friction") == pytest.approx(TRUE.cylinder1.coulomb_friction, rel=0.02)
    assert value_of(found.rig, "mechanics.mass") == pytest.approx(TRUE.mechanics.mass, rel=0.01)
    assert not [line for line in found.words() if "more than noise" in line]


@pytest.mark.slow
@pytest.mark.weekly
def test_a_law_that_is_asked_for_is_fitted_alone_and_may_not_fit() -> None:
    found = found_of("elasto_plastic", "lugre")
    assert found.rig.friction.law == "lugre"
    assert not found.laws.chances
    assert [line for line in found.words() if "more than noise" in line and "another law of friction, friction along" in line]


@pytest.mark.slow
@pytest.mark.weekly
def test_friction_that_no_law_has_is_warned_of() -> None:
    """Friction that varies along the stroke, by the second model."""
    carry = strange(TRUE, Strangeness(friction_wave=0.3))
    log = run_plan(propose(OWNER, 5.0, 5), [TRUE], BacksteppingController(OWNER), "lab", 8, carry=carry)[0]
    (line,) = [line for line in identify(log, OWNER, 0).words() if "more than noise" in line]
    assert "another law of friction (none of " in line


@pytest.mark.slow
@pytest.mark.weekly
def test_maxwell_slip_is_warned_of() -> None:
    (line,) = [line for line in found_of("gms").words() if "more than noise" in line]
    assert "--friction-law gms" in line
