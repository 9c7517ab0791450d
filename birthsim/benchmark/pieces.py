"""A piece of a score: some episodes in one task, of which what a row needs is kept."""

import time
from typing import Any

from agents.foreign.policies import evaluate_file
from baselines.bench.pieces import evaluate_piece, piece_under
from baselines.controller import RESIDUAL, Controller
from baselines.work.tasks import Result

KEPT = ("seeds", "lost", "success", "required_strength_ratio")


def score_piece(kind: str, statistics: str = "", **settings: Any) -> Result:
    """One piece of what has a file; ``statistics``, a hash, only tells pieces apart."""
    started = time.perf_counter()
    if kind == "controller":
        result = evaluate_piece(**settings)
    elif kind == RESIDUAL:
        from agents.policy.pieces import evaluate_learned  # late: it needs the extra agents

        result = evaluate_learned(**settings)
    else:
        result = evaluate_file(**settings)
    return _needed(result, time.perf_counter() - started)


def score_under(
    law: Controller, name: str, rig: dict[str, Any], environment: str, world: dict[str, Any], seed: int, episodes: int
) -> Result:
    """One piece under a controller that has been made."""
    started = time.perf_counter()
    return _needed(piece_under(law, name, rig, environment, world, seed, episodes), time.perf_counter() - started)


def _needed(result: Result, seconds: float) -> Result:
    own = {"returns": result["returns"]["1.0"], "errors": result["metrics"]["settled_rms"], "seconds": seconds}
    return {**{name: result[name] for name in KEPT}, **own}
