"""``birthsim.identify``: a rig from a laboratory's log, from Python."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tqdm import tqdm

from baselines.identification.fit.laws import LAWS
from baselines.identification.identified import Identified
from baselines.identification.identified import identify as identify_trial
from baselines.identification.log.log_columns import LogOptions
from baselines.identification.log.log_file import read_trial
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.physics.rig.values import path_of, shown


def identify(
    log: str | os.PathLike[str],
    parameters: Any = None,
    *,
    columns: Mapping[str, str] | None = None,
    skip: int | None = None,
    decimal_comma: bool = False,
    seed: int = 0,
    friction_law: str | None = None,
    progress: bool = True,
) -> Identified:
    r"""Estimate friction, mass, valves, dead volume and latency of a rig from a log, as ``birthsim identify`` does.

    Parameters
    ----------
    log : str or path
        A file .csv, .parquet, .mcap or .mat of T evenly spaced rows: time (s), openings of chambers P1, N1, P2, N2 (-1 to 1),
        their absolute pressures (Pa), position x, y of the end effector (m), and the hand's force x, y (N). Other units and
        names are recognised where a heading says them.
    parameters : Parameters, path, mapping or None
        The rig as its owner knows it, which gives what a log cannot tell.
    columns : mapping of str to str, optional
        What columns of the log are called, ``{"force_x": "Fz", "force_y": "none"}``; of one in volts also how it becomes SI,
        ``{"opening": "u*0.2-1"}``.
    skip : int, optional
        Lines of the log before its heading, where that is not found by itself.
    decimal_comma : bool
        Whether the log has decimal commas.
    seed : int
        Of the rigs at which the search begins besides the owner's.
    friction_law : str, optional
        The friction law that is fitted, such as ``"elasto_plastic"``; else the one that the log supports best.
    progress : bool
        Whether a bar counts the evaluations of the search.

    Returns
    -------
    Identified
        ``rows``, the parameters with their 95 % intervals, ``rig``, a ``Parameters``, and more.

    Raises
    ------
    ValueError
        Says in one line what is wrong with the log, the rig or an argument.

    Notes
    -----
    Predictions of short windows of the log are fitted to what was measured by least squares, with the owner's values as
    priors. Friction laws are compared by how well the fit of each predicts windows that did not guide it. docs/identify.md has
    the method, an experiment that tells all parameters, and how well it finds known rigs.

    Examples
    --------
    An experiment on a simulated rig that is heavier than its owner knows (``birthsim identify --propose`` and
    ``--simulate`` do the same), and the rig from its log:

    >>> import birthsim, pathlib, tempfile
    >>> from baselines.identification.experiment import propose
    >>> from baselines.identification.laboratory import run_plan
    >>> from baselines.identification.log.log_file import write_trial
    >>> known = birthsim.Parameters()
    >>> true = known.replace({"mechanics.mass": 3.6})
    >>> law = birthsim.make_controller("backstepping")
    >>> trial = run_plan(propose(known, duration=4.0), [true], law, "lab", 0, lambda *_: None)[0]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = pathlib.Path(folder) / "log.csv"
    ...     write_trial(trial, log, known)
    ...     few = log.write_text("".join(log.read_text().splitlines(True)[:2200]))  # 2.2 s, to be quick
    ...     found = birthsim.identify(log, known, progress=False)
    >>> round(found.rig.mechanics.mass, 1)
    3.6
    """
    path = path_of(log)
    if path is None:
        raise ValueError(f"log = {shown(log)}; allowed: the path of a file")
    if not (columns is None or isinstance(columns, Mapping)):
        raise ValueError(f"columns = {shown(columns)}; allowed: a mapping such as {{'force_x': 'Fz'}}")
    if not (friction_law is None or (isinstance(friction_law, str) and friction_law in LAWS)):
        raise ValueError(f"friction_law = {shown(friction_law)}; allowed: None or {', '.join(LAWS)}")
    owner = load_parameters(parameters)
    mapped = ",".join(f"{name}={column}" for name, column in (columns or {}).items())
    trial = read_trial(Path(path), owner, LogOptions(mapped, skip, decimal_comma))
    with tqdm(desc="fit", unit=" evaluations", leave=False, disable=not progress) as bar:
        return identify_trial(trial, owner, seed, tick=bar.update, friction_law=friction_law)
