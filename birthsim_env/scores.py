"""Reference scores: what an episode of an environment pays with shut valves, under the laws, and with a learned policy.

``birthsim study scores`` measures them and writes the file that lies beside this module.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from birthsim_env.assembly import one_of
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each
from birthsim_env.physics.rig.values import shown

FILE = Path(__file__).with_name("scores.json")

SHUT, BEST = "shut valves", "best classical law"
"""Scores of 0 and of 100."""

ROLES = (SHUT, "random valves", "paper's law", BEST, "best learned policy")

SENSORS = ("ideal", "lab")
"""Sensor models that there are scores for."""

RIGS = {False: "nominal", True: "drawn"}
"""The environments' argument ``randomize`` -> the name of its scores."""


@cache
def _scores() -> dict[str, Any]:
    scores: dict[str, Any] = read_json("scores", FILE, {"scores": Each(dict)})["scores"]
    return scores


def reference_scores(environment: str, sensors: str = "ideal", randomize: bool = True) -> dict[str, dict[str, Any]]:
    """What is known of an environment: role (``ROLES``) -> values.

    The values are the ``controller``'s name, the mean ``return`` of an episode, undiscounted, the ``error`` (mm, median over
    episodes of the settled error; None where most are lost), and the fractions ``lost`` and ``success``.

    They are of the id with its default arguments, apart from ``sensors`` and ``randomize`` (rig and scenario together,
    or neither). An environment with a law inside has the scores of the one without. Raises ``ValueError`` naming what has no
    scores.
    """
    names = {environment_id(scenario, kind): scenario for scenario in SCENARIOS for kind in ("", "Residual")}
    if not isinstance(environment, str) or environment not in names:
        allowed = ", ".join(environment_id(scenario) for scenario in SCENARIOS)
        raise ValueError(f"environment = {environment!r}; allowed: {allowed}, and the same with Residual before -v")
    one_of("sensors", sensors, SENSORS)
    one_of("randomize", randomize, tuple(RIGS))
    return _scores()[names[environment].capitalize()][sensors][RIGS[randomize]]  # type: ignore[no-any-return]


def normalized_score(
    environment: str, score: ArrayLike, sensors: str = "ideal", randomize: bool = True
) -> float | NDArray[np.float64]:
    """An episode's return, undiscounted, or an array of them, on a scale where shut valves have 0 and the best classical law
    has 100; see ``reference_scores`` for the arguments."""
    known = reference_scores(environment, sensors, randomize)
    if np.asarray(score).dtype.kind not in "iuf":
        raise ValueError(f"score = {shown(score)}; allowed: a number or an array of numbers")
    nothing, best = known[SHUT]["return"], known[BEST]["return"]
    scaled = 100.0 * (np.asarray(score, dtype=np.float64) - nothing) / (best - nothing)
    return scaled if scaled.ndim else float(scaled)
