"""Environments by their ids, also those with a controller inside, which ``agents`` registers."""

from typing import Any, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray

import agents as agents  # registers ids with a controller inside
from birthsim_env.ids import environment_ids
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.vector_env import BirthSIMVectorEnv


def environments() -> list[str]:
    """List the ids of all environments, in the order of the alphabet.

    Those with ``Residual`` in their name have a controller inside, which a policy corrects.

    Returns
    -------
    list of str
        What ``make`` and ``make_vec`` take. Gymnasium's own functions take them too, after ``import birthsim_env``, or
        ``import agents`` for those with a controller inside.

    Examples
    --------
    >>> import birthsim
    >>> birthsim.environments()[:2]
    ['BirthSIM/Circle-v2', 'BirthSIM/CircleResidual-v2']
    """
    return environment_ids()


def make(environment: str, **arguments: Any) -> gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]:
    """Make a single environment, one lane of the simulation.

    Parameters
    ----------
    environment : str
        One of ``environments()``.
    **arguments
        Of the environment, such as ``sensors="lab"`` or ``randomize=True``; the docstring of
        ``birthsim_env.env.BirthSIMEnv`` lists them, and those of an id with a controller inside are also the fields of
        ``agents.ResidualSettings``.

    Returns
    -------
    gymnasium.Env
        Observations are (20 + n,) float32, actions (n,) float32 in [-1, 1], where n is 4 with the default valves.

    Raises
    ------
    ValueError
        Names an id that there is not, or the argument, its value and what is allowed.
    TypeError
        For an argument that there is not.

    See Also
    --------
    make_vec : many lanes at once.

    Examples
    --------
    >>> import birthsim
    >>> env = birthsim.make("BirthSIM/Circle-v2", sensors="lab", randomize=True)
    >>> observation, info = env.reset(seed=0)
    >>> observation.shape, env.action_space.shape
    ((24,), (4,))
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    >>> env.close()
    """
    return gymnasium.make(_known(environment), **arguments)


def make_vec(environment: str, num_envs: int = 1, **arguments: Any) -> BirthSIMVectorEnv:
    """Make the vector environment of an id: N lanes of one scenario in one compiled call.

    Parameters
    ----------
    environment : str
        One of ``environments()``.
    num_envs : int
        Number of lanes N, at least 1.
    **arguments
        As of ``make``; besides ``device``, ``"cpu"``, or ``"cuda"`` for an NVIDIA GPU, ``max_episode_steps`` and
        ``autoreset_mode``, see ``birthsim_env.vector_env.BirthSIMVectorEnv``.

    Returns
    -------
    BirthSIMVectorEnv
        Observations are (N, 20 + n) float32, actions (N, n) in [-1, 1], rewards (N,).

    Raises
    ------
    ValueError
        Names an id that there is not, or the argument, its value and what is allowed.
    TypeError
        For an argument that there is not.

    Notes
    -----
    Lane i, seeded s + i by ``reset(seed=s)``, matches a single environment seeded s + i bit for bit.

    Examples
    --------
    >>> import birthsim
    >>> worlds = birthsim.make_vec("BirthSIM/Circle-v2", num_envs=3, randomize=True)
    >>> observations, infos = worlds.reset(seed=0)
    >>> observations.shape
    (3, 24)
    >>> worlds.measurement.position.shape
    (2, 3)
    >>> worlds.close()
    """
    return cast(BirthSIMVectorEnv, gymnasium.make_vec(_known(environment), num_envs=num_envs, **arguments))


def _known(environment: str) -> str:
    """``environment``, where it is an id of BirthSIM's."""
    known = environments()
    if not isinstance(environment, str) or environment not in known:
        asked = near(environment, known) if isinstance(environment, str) else ""
        raise ValueError(f"environment = {shown(environment)}{asked}; allowed: {', '.join(known)}")
    return environment
