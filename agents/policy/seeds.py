"""Policies of several training seeds: where they are, and what they reach together."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.policy.files import WEIGHTS, Policy, read_policy
from baselines.bench.evaluation import Evaluation
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import LOST_ERROR, crossed_interval, interquartile_mean, jsonable, penalize_lost, quantile
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.schema import fault
from birthsim_env.physics.rig.values import near, path_of, shown
from birthsim_env.registry import entry, names

SHOWN = ("settled_rms", "settled_rms_x", "settled_rms_y", "stiffness_error", "hunting_x", "hunting_y", "saturation", "air")
"""Metrics of the table over seeds, where an episode says something about them."""


COLUMNS = ("metric", "unit", "statistic", "law", "residual", "low", "high")
"""Of ``seed_metrics``; low and high are the residual's interval."""


def policy_folders(path: str | os.PathLike[str]) -> list[Path]:
    """The policy folders at ``path``: itself, or its ``seed_*`` in order; or those of a registered name.

    Raises ``ValueError`` where there is none.
    """
    text = path_of(path)
    known = names("policy")
    if text is None:
        raise ValueError(f"policy = {shown(path)}; allowed: a folder that birthsim train wrote, or {', '.join(known)}")
    folder = entry("policy", text).made if text in known else Path(text)
    if os.path.isfile(folder / WEIGHTS):
        return [folder]
    seeds = folder.glob(f"seed_*/{WEIGHTS}") if os.path.isdir(folder) else ()
    found = sorted(
        (place.parent for place in seeds if place.parent.name.removeprefix("seed_").isdecimal()),
        key=lambda place: int(place.name.removeprefix("seed_")),
    )
    if not found:
        raise ValueError(
            f"policy = {shown(text)} holds no policy{near(text, known)}; "
            f"allowed: a folder that birthsim train wrote, or {', '.join(known)}"
        )
    return found


def best_policy(path: str | os.PathLike[str]) -> Path:
    """The policy folder at ``path``, of several seeds the one that did best in validation.

    Raises as ``policy_folders``, and ``ValueError`` where a policy says no error in mm that it reached, or none of several was
    finite.
    """
    folders = policy_folders(path)
    if len(folders) == 1:
        return folders[0]
    errors = {folder: error for folder in folders if (error := _validation_error(folder)) is not None}
    if not errors:
        raise ValueError(
            f"policy = {shown(str(path))} has no seed whose validation has a finite error (reached.pooled_mm); allowed: such "
            "seeds, or the folder of one of them"
        )
    return min(errors, key=lambda folder: errors[folder])


def load_policy(policy: str | os.PathLike[str]) -> Policy:
    """Load a trained policy.

    Parameters
    ----------
    policy : str or path
        The name of one that comes with the package, such as ``"circle"``, or a folder that ``train`` wrote. Of several seeds
        it is the one that did best in validation.

    Returns
    -------
    Policy
        The network, the environment that it was trained on, and what it may do.

    Raises
    ------
    ValueError
        Says what is missing, damaged or foreign.

    Examples
    --------
    >>> import birthsim
    >>> policy = birthsim.load_policy("circle")
    >>> policy.environment, policy.settings.law
    ('BirthSIM/CircleResidual-v2', 'backstepping-force-first')

    It acts in an environment with its controller inside:

    >>> worlds = birthsim.make_vec(policy.environment, num_envs=2, **policy.settings.to_dict())
    >>> act = policy.network.acting()
    >>> observations, infos = worlds.reset(seed=0)
    >>> act(observations).shape == worlds.action_space.shape
    True
    >>> worlds.close()
    """
    return read_policy(best_policy(policy))


def _validation_error(folder: Path) -> float | None:
    """Pooled error of a policy in validation, mm; None where that says nothing."""
    training = read_policy(folder).training
    problem = fault(training, {"reached": {"pooled_mm": (float, None)}}, "training")
    error = None if problem else training["reached"]["pooled_mm"]
    if not problem and error is not None and not 0 <= error < float("inf"):
        problem = f"training.reached.pooled_mm = {shown(error)}; allowed: a finite error, mm"
    if problem:
        allowed = f"allowed: a folder that birthsim train wrote ({problem})"
        raise ValueError(f"policy = {shown(str(folder))} does not say what it reached in validation; {allowed}")
    return None if error is None else float(error)


def pooled(values: Array) -> float:
    """RMS of all values, mm, of which an infinite one, a lost episode, counts as ``LOST_ERROR``."""
    return float(np.sqrt(np.mean(np.square(penalize_lost(values, np.isinf(values), True, LOST_ERROR)))))


def seed_metrics(law: Evaluation, residuals: Sequence[Evaluation]) -> dict[str, Any]:
    """Law and residual over training seeds, on the episodes that the rig's strength suffices for, as JSON takes it.

    ``rows`` have ``COLUMNS``: interquartile means with 95 % bootstrap intervals over seeds and episodes, what the residual
    takes off the law's error (None where most episodes are lost), and the pooled error of each seed.
    """
    feasible = np.asarray(law.required_strength_ratio) < 1.0
    rows: list[list[Any]] = []

    def sizes(evaluation: Evaluation, metric: str) -> Array:
        return np.abs(penalize_lost(evaluation.metrics[metric], evaluation.lost))

    def add(metric: str, name: str, statistic: Callable[[Array], float]) -> None:
        matrix = np.stack([sizes(one, metric) for one in residuals])[:, feasible]
        if not np.isnan(matrix).all():
            metrics = [statistic(sizes(law, metric)[feasible]), statistic(matrix)]
            rows.append([metric, UNITS[metric], name, *metrics, *crossed_interval(statistic, matrix)])

    for metric in SHOWN:
        add(metric, "interquartile mean", interquartile_mean)
    fractions = (("median", 0.5), ("95 %", 0.95), ("max", 1.0))
    for name, statistic in (("pooled RMS", pooled), *((name, _fraction(part)) for name, part in fractions)):
        add("settled_rms", name, statistic)
    base = sizes(law, "settled_rms")
    matrix = np.stack([sizes(one, "settled_rms") for one in residuals])
    both = np.stack([np.broadcast_to(base, matrix.shape), matrix], axis=-1)
    for name, statistic in (("pooled RMS", pooled), ("interquartile mean", interquartile_mean)):

        def less(values: Array, statistic: Callable[[Array], float] = statistic) -> float:
            return 100 * (1 - statistic(values[..., 1]) / statistic(values[..., 0]))

        off = less(both[:, feasible])
        said = [off, *crossed_interval(less, both[:, feasible])] if np.isfinite(off) else [None] * 3
        rows.append(["settled_rms", "%", f"less, {name}", None, *said])
    each, lost = [pooled(row[feasible]) for row in matrix], [int(sum(one.lost)) for one in residuals]
    rows += [
        ["settled_rms", "mm", "pooled RMS of each seed", None, each, None, None],
        ["settled_rms", "mm", f"pooled RMS of all {len(feasible)} episodes", pooled(base), pooled(matrix), None, None],
        ["lost", "", f"episodes; {LOST_ERROR:g} mm in a pooled RMS", int(sum(law.lost)), lost, None, None],
    ]
    counts = {"within": int(feasible.sum()), "episodes": len(feasible), "seeds": len(residuals)}
    found: dict[str, Any] = jsonable({**counts, "law": law.controller, "columns": list(COLUMNS), "rows": rows})
    return found


def as_table(found: dict[str, Any]) -> str:
    """Markdown of what ``seed_metrics`` gives."""
    lines = [
        f"{found['within']} of {found['episodes']} episodes are within the rig's strength; {found['seeds']} training seeds.",
        "",
        f"| metric | unit | statistic | {found['law']} | residual | 95 % interval over seeds and episodes |",
        "|---|---|---|---|---|---|",
    ]
    for metric, unit, name, law, residual, low, high in found["rows"]:

        def text(value: Any, digits: str = ".1f" if name.startswith("less") else ".3g") -> str:
            if isinstance(value, list):
                return ", ".join(map(text, value))
            return "" if value is None else str(value) if isinstance(value, int | str) else f"{value:{digits}}"

        interval = "" if low is None else f"{text(low)} to {text(high)}"
        shown = "most episodes are lost" if residual is None else text(residual)
        lines.append(f"| {metric} | {unit} | {name} | {text(law)} | {shown} | {interval} |".replace("|  |", "| |"))
    return "\n".join(lines)


def _fraction(fraction: float) -> Callable[[Array], float]:
    return lambda values: quantile(values, fraction)
