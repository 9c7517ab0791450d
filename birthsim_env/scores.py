"""Reference returns: what an episode of an environment pays with shut valves, with controllers, and with a learned policy.

``birthsim study scores`` measures them and writes the file that lies beside this module.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from birthsim_env.assembly import one_of
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import names

FILE = Path(__file__).with_name("scores.json")

SHUT, BEST = "shut valves", "best classical law"
"""Ends of the scale, 0 and 100."""

ROLES = (SHUT, "random valves", "paper's law", BEST, "best learned policy")

SENSORS = ("ideal", "lab")
"""Sensor models that there are returns for."""

RIGS = {False: "nominal", True: "drawn"}
"""The environments' argument ``randomize`` -> the name of its returns."""


@cache
def _scores() -> dict[str, Any]:
    scores: dict[str, Any] = read_json("scores", FILE, {"scores": Each(dict)})["scores"]
    return scores


def _scored() -> dict[str, Any]:
    """Id -> returns, of the environments that have any."""
    scores = _scores()
    return {
        environment_id(scenario, kind): scores[name]
        for scenario in names("scenario")
        if (name := environment_id(scenario).removeprefix("BirthSIM/").rpartition("-v")[0]) in scores
        for kind in ("", "Residual")
    }


def is_scored(environment: str) -> bool:
    """Whether there are returns of an environment; a scenario that studies do not measure has none."""
    return environment in _scored()


def reference_returns(environment: str, sensors: str = "ideal", randomize: bool = True) -> dict[str, dict[str, Any]]:
    """What controllers reach in an environment, as it was measured.

    Parameters
    ----------
    environment : str
        An id; one with a controller inside has the returns of the one without.
    sensors : str
        ``"ideal"`` or ``"lab"``.
    randomize : bool
        Whether rig and scenario are drawn; all other arguments of the environment are the defaults.

    Returns
    -------
    dict of str to dict
        Role (``"shut valves"``, ``"random valves"``, ``"paper's law"``, ``"best classical law"``, ``"best learned policy"``)
        -> the ``controller``'s name, the mean ``return`` of an episode, undiscounted, the ``error`` (mm, median over episodes
        of the settled error; None where most are lost), and the fractions ``lost`` and ``success``.

    Raises
    ------
    ValueError
        Names what has no returns.

    Notes
    -----
    ``birthsim study scores`` measures them; docs/scores.md has the tables.

    Examples
    --------
    >>> import birthsim
    >>> known = birthsim.reference_returns("BirthSIM/Circle-v2")
    >>> known["shut valves"]["return"] < known["best classical law"]["return"]
    True
    """
    scored = _scored()
    if not isinstance(environment, str) or environment not in scored:
        allowed = ", ".join(name for name in scored if "Residual" not in name)
        raise ValueError(
            f"environment = {environment!r} has no reference returns; allowed: {allowed}, and the same with Residual before -v"
        )
    one_of("sensors", sensors, SENSORS)
    one_of("randomize", randomize, tuple(RIGS))
    return scored[environment][sensors][RIGS[randomize]]  # type: ignore[no-any-return]


def normalized_return(
    environment: str, total: ArrayLike, sensors: str = "ideal", randomize: bool = True
) -> float | NDArray[np.float64]:
    """An episode's return on a linear scale where shut valves have 0 and the best classical controller has 100.

    It says how far a training is. The benchmark's score (``birthsim.score``) is another, logarithmic in the settled error.

    Parameters
    ----------
    environment : str
        An id.
    total : float or array-like
        Sum of the rewards of an episode, undiscounted, or an array of such sums.
    sensors, randomize
        As of ``reference_returns``.

    Returns
    -------
    float or array
        As ``total``.

    Raises
    ------
    ValueError
        Names what has no returns, and a ``total`` that is no number.

    Examples
    --------
    >>> import birthsim
    >>> best = birthsim.reference_returns("BirthSIM/Circle-v2")["best classical law"]["return"]
    >>> birthsim.normalized_return("BirthSIM/Circle-v2", best)
    100.0
    """
    known = reference_returns(environment, sensors, randomize)
    try:
        given = floats_of(total)
    except ValueError as error:
        raise ValueError(f"total = {shown(total)}: {error}; allowed: a number or an array of numbers") from error
    nothing, best = known[SHUT]["return"], known[BEST]["return"]
    scaled = 100.0 * (given - nothing) / (best - nothing)
    return scaled if scaled.ndim else float(scaled)
