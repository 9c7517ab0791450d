"""A policy by its file as a controller of a rig: an archive of Stable-Baselines3, ONNX, or what a file of Python has."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from agents.foreign import onnx_file, stable_baselines
from agents.foreign.acting import ActingController, spaces_of
from agents.foreign.onnx_file import OnnxPolicy
from agents.foreign.stable_baselines import is_model, one_thread, policy_of_model, read_archive
from baselines.bench.pieces import piece_under
from baselines.controller import Controller, is_ready
from baselines.work.tasks import Result
from birthsim_env.parts.callables import arguments_of
from birthsim_env.parts.own_parts import from_file
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem, shown

SUFFIXES = (stable_baselines.SUFFIX, onnx_file.SUFFIX)
"""Of files that are policies."""

ALLOWED = (
    "a controller's name, file.py:Name, a folder that birthsim train wrote, FILE.zip of Stable-Baselines3 or FILE.onnx; in "
    "Python also a model of Stable-Baselines3, a controller, or a function from observations (N, D) to actions (N, n)"
)


def read_policy_file(path: str, rig: Parameters, policy_period: float, normalize: str = "") -> Controller:
    """The controller that a policy's file makes; ``ValueError`` for a file that is none, of other spaces, or that needs what is
    not installed. ``normalize`` is a file of ``VecNormalize``, for an archive."""
    file, spaces = Path(path), spaces_of(rig)
    if normalize and file.suffix != stable_baselines.SUFFIX:
        raise ValueError(f"normalize = {shown(normalize)} with policy = {shown(path)}; allowed: with {stable_baselines.SUFFIX}")
    if file.suffix == onnx_file.SUFFIX:
        policy = OnnxPolicy(file)
        if policy.settings is not None:
            from agents.policy.controller import ResidualController  # late: it needs the extra agents

            return ResidualController(rig, policy, policy.settings)
        policy.check(file, spaces)
        return ActingController(policy, rig, policy_period, path)
    if file.suffix == stable_baselines.SUFFIX:
        model = read_archive(file, spaces, Path(normalize) if normalize else None)
        return ActingController(model, rig, policy_period, path)
    found = acting_part(from_file("policy", path))
    if found is None:
        raise ValueError(f"policy = {shown(path)}; allowed: {ALLOWED}")
    return acting_controller(found, rig, policy_period, path)


def acting_part(part: Any) -> Any:
    """A user's part as a policy of an environment, that is a model, or a function or object that is called with observations;
    None where it is something else. Of a class an instance."""
    if inspect.isclass(part) and not hasattr(part, "command") and "__call__" in vars(part):
        if not arguments_of(part).take(0):
            return None
        try:
            part = part()
        except Exception as error:
            raise ValueError(f"policy: {part.__name__}() fails ({problem(error)}); allowed: {ALLOWED}") from error
    if is_model(part):
        return part
    return part if callable(part) and not inspect.isclass(part) and not is_ready(part) and arguments_of(part).take(1) else None


def acting_controller(policy: Any, rig: Parameters, policy_period: float, name: str) -> Controller:
    """A model, or a function of observations, as a controller; ``ValueError`` for a model of other spaces."""
    act: Callable[[Any], Any] = policy_of_model(policy, name, spaces_of(rig)) if is_model(policy) else policy
    return ActingController(act, rig, policy_period, name)


def evaluate_file(
    controller: str, source: str, rig: dict[str, Any], policy_period: float, normalize: str, files: list[str], **world: Any
) -> Result:
    """One piece of an evaluation under a policy's file; ``source`` and ``files``, hashes, only tell pieces apart."""
    with one_thread():
        law = read_policy_file(controller, Parameters.from_dict(rig), policy_period, normalize)
        return piece_under(law, controller, rig, **world)
