"""A reader learns what rigs are from rounds of episodes on rigs that are known: the likelihood of the truth, by Adam.

Let t be the truth, m and s what is said of it, all logarithms over what is described in units of the spread of rigs. Then the
loss of a reading is (t - m)^2/(2 s^2) + log s, its mean over parameters, readings and lanes (a normal distribution's). Rounds
are kept in the folder, some 30 MB each, so that a teaching that was interrupted goes on, and ends with the same reader.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import torch
from numpy.typing import NDArray
from tqdm import tqdm

from agents.reader.rounds import Round, collect
from agents.reader.settings import ReaderSettings
from agents.training.checkpoint import read_checkpoint, require_moments, tensors, write_checkpoint
from agents.training.differentiated import Differentiated
from agents.training.validation import TRAINING_SEED, VALIDATION_SEED
from baselines.estimation.readers import save_reader
from baselines.estimation.rig_filter import EVERY, SETTLING, SIZE, TOLD, spread_of
from baselines.estimation.rig_reader import FAR, INPUTS, READ, SUMS, SURE
from baselines.network import CLIP, EPSILON, PolicyNetwork
from birthsim_env.files import make_folder, whole_file
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem

SEED, BETWEEN_ROUNDS, BETWEEN_SEEDS = TRAINING_SEED + 700_000, 1000, 100_000
"""First seed of the worlds, and between those of neighbouring rounds and seeds."""

CHECKED = ("circle", "probe")
"""Scenarios in which a reader is judged, on friction as described."""

READER, ROUNDS, EVERY_UPDATES = "reader.npz", "rounds", 50
"""Files, and updates from one checkpoint to the next."""

LEAST, MOST = -5.0, 1.0
"""Bounds of log s."""

RATE_LEFT, LARGEST_GRADIENT, LEAST_DEVIATION = 0.02, 1.0, 1e-3
"""1; assumed: fraction of the learning rate at the end, norm beyond which gradients are shortened, and least standard deviation
of an input."""

SHOWN_AT = (1.0, 2.5, 4.9)
"""s: when errors are reported."""

MEANS = slice(2 * len(SUMS), 2 * len(SUMS) + READ)
DEVIATIONS = slice(2 * len(SUMS) + SIZE, 2 * len(SUMS) + SIZE + READ)
"""Where a reader sees what the filter found, and the logarithms of how sure it is."""


def teach(settings: ReaderSettings, rig: Parameters, folder: Path, position: int = 0) -> dict[str, Any]:
    """Teach one reader and write it to ``folder``, as ``reader.npz``; returns what it reached.

    Raises ``ValueError`` for a checkpoint that is damaged or of other settings."""
    torch.set_num_threads(1)
    torch.manual_seed(settings.seed)
    began = time.process_time()
    spacing = BETWEEN_SEEDS * settings.seed
    rounds = [_round(settings, rig, folder, k, SEED + spacing + BETWEEN_ROUNDS * k, position) for k in range(settings.rounds)]
    collected = time.process_time() - began
    mean = np.mean([one.seen.mean((0, 1), dtype=np.float64) for one in rounds], axis=0)
    deviation = np.mean([one.seen.std((0, 1), dtype=np.float64) for one in rounds], axis=0) + LEAST_DEVIATION
    student = untaught(settings.hidden)
    adam = torch.optim.Adam(student.parameters(), lr=settings.learning_rate)
    about = settings.to_dict()
    done = _restored(folder, about, student, adam)
    bar = tqdm(total=settings.updates, initial=done, desc=f"seed {settings.seed}", unit=" updates", position=position)
    try:
        for update in range(done, settings.updates):
            _update(settings, update, rounds, mean, deviation, student, adam)
            bar.update()
            if (update + 1) % EVERY_UPDATES == 0 or update + 1 == settings.updates:
                write_checkpoint(folder, about, _content(update + 1, student, adam))
    finally:
        bar.close()
    network = _network(student, mean, deviation)
    save_reader(network, folder / READER)
    reached = {scenario: _reached(settings, rig, student, mean, deviation, scenario) for scenario in CHECKED}
    seconds = {"collecting": collected, "learning": time.process_time() - began - collected}
    return {"settings": about, "weights": _weights(network), "cpu_seconds": seconds, "reached": reached}


def untaught(cells: int) -> Differentiated:
    """A reader that says what the filter finds, to be taught."""
    return Differentiated(INPUTS, 2 * READ, (cells,), cells, squashed=False)


def _weights(network: PolicyNetwork) -> int:
    return sum(array.size for pair in (*network.layers, *network.memory) for array in pair)


def _round(settings: ReaderSettings, rig: Parameters, folder: Path, number: int, seed: int, position: int) -> Round:
    """A round from its file, where it is there."""
    path = make_folder(folder / ROUNDS) / f"{number}.npz"
    if path.is_file():
        try:
            with path.open("rb") as raw, np.load(raw) as file:
                if (int(file["seed"]), file["truth"].shape) == (seed, (settings.lanes, READ)):
                    return Round(file["seen"], file["truth"], file["alive"])
        except (OSError, KeyError, ValueError, TypeError, EOFError, BadZipFile) as error:
            raise ValueError(
                f"{str(path)!r} is damaged ({problem(error)}); allowed: a file that this training wrote"
            ) from error
    tqdm.write(f"round {number + 1} of {settings.rounds}: {settings.lanes} episodes") if not position else None
    made = collect(settings, rig, number, seed)
    with whole_file(path) as file:
        np.savez(file, seed=seed, seen=made.seen, truth=made.truth, alive=made.alive)
    return made


def _normalized(seen: NDArray[np.float32], mean: NDArray[Any], deviation: NDArray[Any]) -> torch.Tensor:
    x = (seen - mean) / np.sqrt(deviation * deviation + EPSILON)
    return torch.from_numpy(np.clip(x, -CLIP, CLIP).astype(np.float32))


def said_of(student: Differentiated, seen: NDArray[np.float32], mean: NDArray[Any], deviation: NDArray[Any]) -> tuple[Any, Any]:
    """Means and logarithms of deviations (T, N, READ) that a reader says, in units of the spread of rigs."""
    answer, _ = student(_normalized(seen, mean, deviation), torch.zeros(seen.shape[1], student.cells))
    answer = answer.clamp(-1.0, 1.0)
    found, unsure = (torch.from_numpy(seen[:, :, place]) for place in (MEANS, DEVIATIONS))
    return found + FAR * answer[..., :READ], (unsure + SURE * answer[..., READ:]).clamp(LEAST, MOST)


def surprise(truth: torch.Tensor, said: torch.Tensor, unsure: torch.Tensor) -> torch.Tensor:
    """Minus the logarithm of the likelihood, but for a constant."""
    return 0.5 * ((truth - said) * torch.exp(-unsure)) ** 2 + unsure


def _update(
    settings: ReaderSettings,
    update: int,
    rounds: list[Round],
    mean: NDArray[Any],
    deviation: NDArray[Any],
    student: Differentiated,
    adam: torch.optim.Optimizer,
) -> None:
    """One step of Adam; what it is on follows from the seed and the number of the update alone."""
    rng = np.random.default_rng((settings.seed, update))
    one = rounds[rng.integers(len(rounds))]
    lanes = rng.permutation(settings.lanes)[: settings.batch]
    said, unsure = said_of(student, one.seen[:, lanes], mean, deviation)
    alive, truth = torch.from_numpy(one.alive[:, lanes].astype(np.float32)), torch.from_numpy(one.truth[lanes])
    loss = (surprise(truth, said, unsure).mean(-1) * alive).sum() / alive.sum()
    adam.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(student.parameters(), LARGEST_GRADIENT)
    left = RATE_LEFT + (1.0 - RATE_LEFT) * (1.0 - update / settings.updates)
    adam.param_groups[0]["lr"] = settings.learning_rate * left
    adam.step()


def _network(student: Differentiated, mean: NDArray[Any], deviation: NDArray[Any]) -> PolicyNetwork:
    return student.network(mean, deviation * deviation)


def _content(updates: int, student: Differentiated, adam: torch.optim.Optimizer) -> dict[str, Any]:
    return {"updates": updates, "student": dict(student.state_dict()), "adam": adam.state_dict()["state"]}


def _restored(folder: Path, about: dict[str, Any], student: Differentiated, adam: torch.optim.Optimizer) -> int:
    """How many updates a checkpoint holds, from which student and optimizer go on; 0 where there is none."""

    def restore(content: dict[str, Any]) -> dict[str, Any]:
        if not 0 <= content["updates"] <= about["updates"]:
            raise ValueError(f"updates = {content['updates']}; allowed: 0 to {about['updates']}")
        student.load_state_dict(tensors(content["student"]))
        state = {int(key): one for key, one in tensors(content["adam"]).items()}
        adam.load_state_dict({"state": state, "param_groups": adam.state_dict()["param_groups"]})
        require_moments(adam)
        return content

    found = read_checkpoint(folder, about, lambda: _content(0, student, adam), restore, restore, ("adam",))
    if found is None:
        return 0
    print(f"seed {about['seed']}: {found['updates']:,} of {about['updates']:,} updates are there and are kept")
    return int(found["updates"])


def _reached(
    settings: ReaderSettings,
    rig: Parameters,
    student: Differentiated,
    mean: NDArray[Any],
    deviation: NDArray[Any],
    scenario: str,
) -> dict[str, Any]:
    """Errors of logarithms on validation worlds, median and 95th percentile: of the reader and of the filter; and how many of
    its errors a reader expects to be smaller than its deviation, 0.68 where that is right."""
    told = ReaderSettings(**{**settings.to_dict(), "scenarios": (scenario,), "frictions": ("",)})
    one = collect(told, rig, 0, VALIDATION_SEED)
    with torch.no_grad():
        said, unsure = (array.numpy() for array in said_of(student, one.seen, mean, deviation))
    spread, reached = spread_of(rig)[:READ], {}
    for moment in SHOWN_AT:
        at = min(round((moment - SETTLING) / EVERY), len(one.seen) - 1)
        alive = one.alive[at]
        errors = {"reader": np.abs(said[at] - one.truth)[alive], "filter": np.abs(one.seen[at, :, MEANS] - one.truth)[alive]}
        figures = {
            name: {
                f"q{share}": dict(zip(TOLD, (np.quantile(error, share / 100, axis=0) * spread).tolist(), strict=True))
                for share in (50, 95)
            }
            for name, error in errors.items()
        }
        within = (errors["reader"] < np.exp(unsure[at][alive])).mean(axis=0)
        reached[f"{moment:g} s"] = {**figures, "within": dict(zip(TOLD, within.tolist(), strict=True))}
    return reached
