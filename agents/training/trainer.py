"""Trains one residual policy: builds worlds and model, learns, keeps the best, and goes on where a killed training stopped."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import gymnasium
import torch
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from agents.policy.files import WEIGHTS
from agents.residual.settings import LAWS, ResidualSettings
from agents.training.checkpoint import NAME as CHECKPOINT
from agents.training.configuration import TrainingSettings, algorithm_of
from agents.training.events import EVENTS, Events, events_in
from agents.training.interruption import WORDS, Interrupted
from agents.training.margin import widened
from agents.training.past import checked_past
from agents.training.reached import Reached, described
from agents.training.watch import Watch
from birthsim_env.endings import one_signal_later


def train(
    settings: TrainingSettings,
    residual: ResidualSettings,
    folder: Path,
    parameters: Any = None,
    position: int = 0,
    ending: Path | None = None,
) -> dict[str, Any]:
    """Train one residual policy and write it to ``folder``; returns what was reached.

    The policy that is best on the validation worlds is kept (pooled error and its 95 % tail together). It is written whenever
    it improves. A checkpoint is written at every validation, ``settings.validations`` times, every ``watch.PERIOD`` s, and
    where the training is asked to end: by Ctrl-C, SIGTERM or SIGHUP, which then come after the update during which they came;
    a second one comes at once. Where ``folder`` has a checkpoint the training goes on from there, and ends with the same
    policy, checkpoint and events as one that was never killed. ``position`` is the row of its progress bar.

    A training in a process beside others ends once there is a file ``ending``, or by a signal, and raises ``Interrupted``.

    Raises ``ValueError`` for a checkpoint that is damaged or of other settings, for a folder with a policy and without its
    checkpoint, and where no validation world is within the rig's strength.
    """
    if not (folder / CHECKPOINT).exists():
        for name in (WEIGHTS, "training.json"):
            if (folder / name).exists():
                raise ValueError(f"{str(folder)!r} has {name} but not its {CHECKPOINT}; allowed: another folder")
    torch.set_num_threads(1)
    rig = settings.rig(parameters)
    arguments = {
        "sensors": settings.sensors, "randomize": settings.randomize, **residual.to_dict(),
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }  # fmt: skip

    def made(lanes: int, margin: float = 0.0) -> list[Any]:
        worlds, more = settings.worlds(), {**arguments, "parameters": widened(rig, margin) if margin else rig}
        return [gymnasium.make_vec(name, num_envs=lanes // len(worlds), **hand, **more) for name, hand in worlds]

    envs, checks, paper = made(settings.lanes, settings.margin), made(settings.validation_lanes), None
    if settings.until < 100:
        arguments |= ResidualSettings(law=LAWS[0], policy_period=residual.policy_period).to_dict()
        paper = made(settings.validation_lanes)
    about = described(settings, residual, checks[0].simulation.parameters)
    learner = algorithm_of(settings.algorithm).learner(settings, envs, folder)
    began = time.perf_counter()
    past = learner.load(about)
    if past is not None:
        past = checked_past(past, settings, folder / CHECKPOINT)
    kept, watch = learner.steps if past is not None else None, None

    def there(steps: int) -> str:
        return f"{min(steps, settings.steps):,} of {settings.steps:,} steps are"

    def interrupted() -> str:
        steps = kept if watch is None else watch.kept
        what = " before its first checkpoint" if steps is None else f"; {there(steps)} kept in {folder}/"
        return f"seed {settings.seed}: interrupted{what}"

    if kept is not None:
        print(f"seed {settings.seed}: {there(kept)} there and are kept")
    bar = tqdm(
        total=settings.steps,
        initial=min(kept or 0, settings.steps),
        desc=f"seed {settings.seed}",
        unit=" steps",
        unit_scale=True,
        position=position,
    )
    try:
        reached = Reached(settings, residual, checks, folder, past, paper)
        if not reached.over:
            with one_signal_later("" if ending else WORDS) as came, events_in(folder / EVENTS):

                def asked() -> bool:
                    return bool(came) or (ending is not None and ending.exists())

                events = Events(folder, past["events"] if past else {})
                watch = Watch(learner, reached, events, past or {}, asked, bar, began)
                learner.learn(watch, past is not None)
                events.close()
                if ending:
                    came.clear()  # this process is one of several, which end together
            if watch.ended:
                raise Interrupted(interrupted())
    except KeyboardInterrupt:
        print(interrupted())
        raise
    finally:
        bar.close()
        for one in (*envs, *checks, *(paper or ())):
            one.close()
    return reached.result()
