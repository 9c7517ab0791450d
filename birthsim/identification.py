"""``birthsim.identify`` and ``birthsim.compare``: a rig from a laboratory's log, and rigs beside one, from Python."""

import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from baselines.identification.comparing.compared import HORIZON, MULTIPLE, Candidate, Comparison, Judging
from baselines.identification.comparing.compared import compare as compare_trials
from baselines.identification.fit.laws import LAWS
from baselines.identification.identified import Identified
from baselines.identification.identified import identify as identify_trial
from baselines.identification.log.log_columns import LogOptions
from baselines.identification.log.log_file import read_trial
from baselines.identification.windows.windows import LENGTH
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import checked_number, path_of, shown

SHORTEST, LONGEST, FURTHEST = 0.05, 5.0, 60.0
"""s: windows from the first to the second; free runs that begin all over the log are followed from the first to the last."""


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
    path, options = _read_as(log, columns, skip, decimal_comma)
    if not (friction_law is None or (isinstance(friction_law, str) and friction_law in LAWS)):
        raise ValueError(f"friction_law = {shown(friction_law)}; allowed: None or {', '.join(LAWS)}")
    owner = load_parameters(parameters)
    trial = read_trial(path, owner, options)
    with tqdm(desc="fit", unit=" evaluations", leave=False, disable=not progress) as bar:
        return identify_trial(trial, owner, seed, tick=bar.update, friction_law=friction_law)


def _read_as(
    log: str | os.PathLike[str], columns: Mapping[str, str] | None, skip: int | None, decimal_comma: bool
) -> tuple[Path, LogOptions]:
    """The file of a log, and how it is read."""
    path = path_of(log)
    if path is None:
        raise ValueError(f"log = {shown(log)}; allowed: the path of a file")
    if not (columns is None or isinstance(columns, Mapping)):
        raise ValueError(f"columns = {shown(columns)}; allowed: a mapping such as {{'force_x': 'Fz'}}")
    mapped = ",".join(f"{name}={column}" for name, column in (columns or {}).items())
    return Path(path), LogOptions(mapped, skip, decimal_comma)


def compare(
    log: str | os.PathLike[str],
    parameters: Any = None,
    *,
    columns: Mapping[str, str] | None = None,
    skip: int | None = None,
    decimal_comma: bool = False,
    window: float = LENGTH,
    multiple: float = MULTIPLE,
    pressure_limit: float | None = None,
    position_limit: float | None = None,
    horizon: float = HORIZON,
    progress: bool = True,
) -> Comparison:
    r"""Play a log's openings and forces through the model of a rig, or of several, as ``birthsim compare`` does.

    Parameters
    ----------
    log : str or path
        A file as ``birthsim.identify`` takes it.
    parameters : Parameters, path, mapping or None, or a list of these
        The rigs. Several are ranked, by the names of their files, or as "rig 1" and so on.
    columns : mapping of str to str, optional
        What columns of the log are called, as for ``identify``.
    skip : int, optional
        Lines of the log before its heading, where that is not found by itself.
    decimal_comma : bool
        Whether the log has decimal commas.
    window : float
        s after which the model is begun anew.
    multiple : float
        A free run has left the log where the error of a signal is so many times its noise.
    pressure_limit, position_limit : float, optional
        Pa and m: limits instead of ``multiple``.
    horizon : float
        s for which free runs are followed that begin all over the log.
    progress : bool
        Whether a bar counts the rigs.

    Returns
    -------
    Comparison
        ``rigs``, each with its errors, its worst windows and its free run, and ``places``, their ranking.

    Raises
    ------
    ValueError
        Says in one line what is wrong with the log, a rig or an argument.

    Notes
    -----
    docs/how-to/compare.md says how errors are taken, and what they tell of a model.

    Examples
    --------
    The log of a rig that is heavier than its file says:

    >>> import birthsim, pathlib, tempfile
    >>> from baselines.identification.experiment import propose
    >>> from baselines.identification.laboratory import run_plan
    >>> from baselines.identification.log.log_file import write_trial
    >>> file = birthsim.Parameters()
    >>> true = file.replace({"mechanics.mass": 3.6})
    >>> law = birthsim.make_controller("backstepping")
    >>> trial = run_plan(propose(file, duration=4.0), [true], law, "lab", 0, lambda *_: None)[0]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = pathlib.Path(folder) / "log.csv"
    ...     write_trial(trial, log, file)
    ...     few = log.write_text("".join(log.read_text().splitlines(True)[:2200]))  # 2.2 s, to be quick
    ...     found = birthsim.compare(log, [file, true], progress=False)
    >>> [place.name for place in found.places], found.places[1].is_worse
    (['rig 2', 'rig 1'], True)
    """
    path, options = _read_as(log, columns, skip, decimal_comma)
    several = isinstance(parameters, Sequence) and path_of(parameters) is None
    judging = judging_of(window, multiple, pressure_limit, position_limit, horizon)
    return compare_log(path, list(parameters) if several else [parameters], options, judging, progress)


def compare_log(
    log: Path, parameters: Sequence[Any], options: LogOptions, judging: Judging, progress: bool = True
) -> Comparison:
    """A log beside rigs, each of them what ``load_parameters`` reads."""
    candidates: list[Candidate] = []
    for name, rig in named_rigs(parameters).items():
        with warnings.catch_warnings():
            if candidates:  # which columns are not used was said of the first rig
                warnings.simplefilter("ignore")
            candidates.append(Candidate(name, rig, read_trial(log, rig, options)))
    with tqdm(total=len(candidates), desc="compare", unit=" rigs", leave=False, disable=not progress) as bar:
        return compare_trials(candidates, judging, bar.update)


def judging_of(
    window: float = LENGTH,
    multiple: float = MULTIPLE,
    pressure_limit: float | None = None,
    position_limit: float | None = None,
    horizon: float = HORIZON,
) -> Judging:
    """How a log is compared, from what a user asks for."""
    return Judging(
        checked_number("window", window, "s", least=SHORTEST, most=LONGEST),
        checked_number("multiple", multiple, "-", above=0.0),
        None if pressure_limit is None else checked_number("pressure_limit", pressure_limit, "Pa", above=0.0),
        None if position_limit is None else checked_number("position_limit", position_limit, "m", above=0.0),
        checked_number("horizon", horizon, "s", least=SHORTEST, most=FURTHEST),
    )


def named_rigs(given: Sequence[Any]) -> dict[str, Parameters]:
    """Rigs by the names that a comparison calls them: of their files, as short as tells them apart, or their numbers."""
    if not given:
        raise ValueError("parameters = []; allowed: at least one rig")
    paths = [path_of(one) for one in given]
    short = [Path(path).name for path in paths if path is not None]
    found: dict[str, Parameters] = {}
    for number, (one, path) in enumerate(zip(given, paths, strict=True), start=1):
        name = "the default rig" if one is None else f"rig {number}"
        if path is not None:
            name = Path(path).name if short.count(Path(path).name) == 1 else path
        if name in found:
            raise ValueError(f"parameters = {shown(path or one)} is given twice; allowed: rigs with a name each")
        found[name] = load_parameters(one)
    return found
