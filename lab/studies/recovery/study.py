"""Randomised rigs, identified from logs of their own."""

from functools import partial
from typing import Any

import numpy as np

from baselines.bench.statistics import quantile
from baselines.identification.fit.free_parameters import FREE_PARAMETERS, LATENCY
from baselines.work.tasks import Task
from birthsim_env.parts.drawn.randomization import Ranges
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.studies.recovery.tasks import EXPERIMENTS, RANGES, recovery_tasks


def _tasks(options: Options) -> dict[Any, Task]:
    tasks = recovery_tasks(options.rigs, options.seed, options.duration, options.experiment)
    return {task.name: task for task in tasks}


def _kept(options: Options, found: Found) -> Any:
    if not found:
        raise ValueError(f"none of {options.rigs} rigs was identified")
    return list(found.values())


def _shown(content: Content, name: str) -> dict[str, str]:
    found, settings = content["figures"], content["settings"]
    head = (
        f"{len(found)} of {settings['rigs']} rigs, seeds from {settings['seed']}, experiment {settings['experiment']} of "
        f"{settings['duration']:g} s, `lab` sensors."
    )
    worst = max(max(result["misfit"]) for result in found)
    last = f"Largest residual over the noise of its log: {worst:.3f}."
    return {f"{name}.md": "\n".join([head, "", *recovery_table(found), "", last]) + "\n"}


def recovery_table(results: list[dict[str, Any]], ranges: Ranges = RANGES) -> list[str]:
    """Markdown: per parameter of the results how many rigs' logs tell it, and of these error and interval."""
    lines = [
        "| parameter | randomised from | told in | error: median | 95th percentile | largest | half interval: median "
        "| true value inside |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in (one for one in FREE_PARAMETERS if all(one.name in result["rows"] for result in results)):
        rows = [result["rows"][one.name] for result in results]
        told = [row for row in rows if row["told"]]
        low, high = ranges.get(one.name, 2 * [value_of(Parameters(), one.name)])
        late = one.name == LATENCY
        scale, unit, digits = (1e3, "ms", 2) if late else (100.0, "%", 2)
        errors = [scale * abs(row["value"] - row["true"]) / (1.0 if late else row["true"]) for row in told]
        halves = [scale * 0.5 * (row["high"] - row["low"]) / (1.0 if late else row["true"]) for row in told]
        cells = [quantile(np.array(errors), f) for f in (0.5, 0.95, 1.0)] + [quantile(np.array(halves), 0.5)]
        inside = sum(row["low"] <= row["true"] <= row["high"] for row in told)
        written = " | ".join(f"{cell:.{digits}g} {unit}" for cell in cells)
        drawn = f"{f'{low:g} to ' if low < high else ''}{high:g} {DECLARED[one.name].unit}"
        lines.append(f"| `{one.name}` | {drawn} | {len(told)} of {len(rows)} | {written} | {inside} of {len(told)} |")
    return lines


def _recovery(name: str, rigs: int, experiment: str) -> Study:
    return Study(
        {"rigs": rigs, "seed": 82000, "duration": 12.0, "experiment": experiment},
        _tasks,
        _kept,
        {"misfit": "of the log's noise", "value": "the parameter's"},
        partial(_shown, name=name),
        partial=True,
        allowed={"experiment": tuple(EXPERIMENTS)},
        words={"duration": "s of each experiment", "rigs": "randomised"},
    )


STUDY, AT_REST = _recovery("recovery", 50, "proposed"), _recovery("recovery-rest", 10, "rest")
register(study="recovery", about="how well identification finds rigs that are known")(STUDY)
register(study="recovery-rest", about="what a log of a rig at rest tells of it")(AT_REST)
