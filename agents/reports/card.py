"""The card of a trained policy, in the format of the Hugging Face Hub: what it was trained on, where it is better and worse."""

import json
from pathlib import Path
from typing import Any

from agents.policy.files import load_policy
from agents.residual.settings import NO_LAW
from birthsim_env import __version__
from birthsim_env.physics.rig.values import shown

TRAINING = "training.json"
"""What a training writes beside a policy."""

FIGURES = {
    "median_mm": ("settled error, median of the episodes", "mm"),
    "tail_mm": ("settled error, 95th percentile", "mm"),
    "pooled_mm": ("settled error, over all episodes", "mm"),
    "stiffness_error_percent": ("stiffness error, median", "%"),
    "hunting_mm": ("hunting, median", "mm"),
    "saturation_percent": ("time with a valve at its limit, median", "%"),
    "lost": ("lost episodes", ""),
}
"""Key in ``TRAINING`` -> name and unit; the smaller, the better."""


def model_card(folder: Path, name: str) -> str:
    """The text of ``README.md`` beside a policy; ``ValueError`` where its training left no figures."""
    policy = load_policy(folder)
    try:
        found = json.loads((folder / TRAINING).read_text(encoding="utf-8"))
        about, whom = found["settings"], [_beside(policy.settings.law), "the paper's controller"]
        others = {who: found[key] for who, key in zip(whom, ("law", "paper"), strict=True) if found[key]}
        columns = {"this policy": found["policy"], **others}
        rows = {
            key: [figures[key] for figures in columns.values()] for key in FIGURES if columns["this policy"][key] is not None
        }
        made = about.get("algorithm") or "imitation of teachers"
        worlds = f"`sensors={about['sensors']!r}`, `randomize={about['randomize']}`"
        infeasible = found["law"]["infeasible"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        problem = f"policy = {shown(str(folder))} has no figures of its training ({error!r})"
        raise ValueError(f"{problem}; allowed: a folder with {TRAINING}, as birthsim train writes it") from error
    result = {
        "task": {"type": "reinforcement-learning", "name": "stiffness control"},
        "dataset": {"type": "gymnasium", "name": policy.environment},
        "metrics": [{"type": key, "name": FIGURES[key][0], "value": row[0]} for key, row in rows.items()],
    }
    table = [
        f"| in validation | unit | {' | '.join(columns)} |",
        "|---|---|" + "---|" * len(columns),
        *(f"| {FIGURES[key][0]} | {FIGURES[key][1]} | {' | '.join(map(_number, row))} |" for key, row in rows.items()),
    ]
    does = (
        "drives the valves by itself" if policy.settings.law == NO_LAW else f"corrects the controller `{policy.settings.law}`"
    )
    return "\n".join([
        "---",
        "license: mit",
        "library_name: birthsim",
        "pipeline_tag: reinforcement-learning",
        "tags: [reinforcement-learning, gymnasium, haptics, birthsim]",
        f"model-index: {json.dumps([{'name': name, 'results': [result]}])}",
        "---",
        "",
        f"# {name}",
        "",
        f"This policy {does} in `{policy.environment}` of BirthSIM {__version__}, at {1 / policy.settings.policy_period:g} Hz.",
        f"It was trained by {made}, with {worlds}.",
        f"It takes {policy.network.inputs} observations and gives {policy.network.outputs} actions.",
        "",
        *table,
        "",
        f"{infeasible} episodes that ask for more than the rig's strength are left out.",
        "",
        *(f"- {_compared(who, rows, k + 1)}" for k, who in enumerate(others)),
        "- The best controllers may be better than all of these: `birthsim_env.reference_scores` has their scores.",
        "- With other sensors, hands and rigs it may be worse than any controller; the command below says so.",
        "- It is a policy of a simulation. No real rig has run it, and it is no medical device.",
        "",
        "      birthsim evaluate --controller admittance-adaptive residual --policy FOLDER --out out/compared",
        "",
    ])  # fmt: skip


def _beside(law: str) -> str:
    return "shut valves" if law == NO_LAW else "the controller alone"


def _compared(who: str, rows: dict[str, list[float | None]], column: int) -> str:
    """In which figures the policy is better and worse than the one of a column."""
    pairs = {FIGURES[key][0]: (row[0], row[column]) for key, row in rows.items()}
    known = {name: (ours, theirs) for name, (ours, theirs) in pairs.items() if ours is not None and theirs is not None}
    better = "; ".join(name for name, (ours, theirs) in known.items() if ours < theirs)
    worse = "; ".join(name for name, (ours, theirs) in known.items() if ours > theirs)
    return f"Beside {who} it is better in: {better or 'nothing'}. It is worse in: {worse or 'nothing'}."


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.3g}"
