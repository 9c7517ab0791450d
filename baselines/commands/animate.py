"""birthsim animate: two controllers in the same world beside each other, as an animated picture in real time."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from PIL import Image
from tqdm import tqdm

from baselines.commands.parts import add_parts, add_set, environment_parts
from baselines.commands.settings import RANDOMIZE
from baselines.commands.shared import finite_number, run, seed_number
from baselines.commands.worlds import check_environment, policy_of, with_options
from baselines.registry import controller_names, make_controller
from baselines.staged import NO_ACTION, driving
from baselines.work.files import make_folder, whole_file
from birthsim_env.drawing.rendering import PairRenderer, Scene
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

RATES = (10, 20, 25, 50)
"""Frames per second whose period is a whole number of the 10 ms that a GIF counts in."""

SAMPLE = 0.005
"""s between the points of the error's curve."""

PAUSE = 1.0
"""s that the last frame stays before the animation begins anew."""

Span = tuple[float, float]


@dataclass
class Take:
    """One controller's run: what frames show, and the size of the tracking error (m) at every ``SAMPLE`` of the span."""

    scenes: list[Scene] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim animate",
        description="Two controllers beside each other on the same rig under the same hand, in real time: linkage, magnifier "
        "(the same for both) and error from the compliant target.",
    )
    parser.add_argument("--env", default="BirthSIM/Forceps-v1", help="environment id (default: %(default)s)")
    parser.add_argument(
        "--controller",
        "--controllers",
        nargs=2,
        default=("backstepping", "admittance-backstepping"),
        metavar="NAME",
        help=f"two of {', '.join(controller_names())}, or path/to/file.py:Class; residual is the policy that "
        "comes with the package for the environment (default: the paper's law and the best one)",
    )
    parser.add_argument("--seed", type=seed_number, default=0, help="of the world (default: %(default)s)")
    parser.add_argument("--sensors", default="ideal", choices=tuple(SENSORS), help="default: %(default)s")
    parser.add_argument(
        "--randomize", default="all", choices=tuple(RANDOMIZE), help="what the seed draws (default: %(default)s)"
    )
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    add_parts(parser)
    add_set(parser)
    parser.add_argument("--begin", type=finite_number, default=0.5, help="s into the episode (default: %(default)s)")
    parser.add_argument("--end", type=finite_number, default=6.5, help="s into the episode (default: %(default)s)")
    parser.add_argument("--rate", type=int, default=25, choices=RATES, help="frames per second (default: %(default)s)")
    parser.add_argument("--out", type=Path, required=True, help="file to write, .webp or .gif")
    run(parser, _animate)


def take(env: Any, seed: int, span: Span, rate: int, progress: Callable[[int], Any]) -> Take:
    """Run an environment that a controller drives in the world of ``seed`` and look at it from ``span[0]`` to ``span[1]`` s.

    A run that the environment ends early stands still from there on, with an infinite error.
    """
    period = env.unwrapped.simulation.parameters.electronics.control_period
    _, info = env.reset(seed=seed)
    machine, found, lost = env.unwrapped, Take(), False
    begin, end = round(span[0] / period), round(span[1] / period)
    sample, frame = round(SAMPLE / period), round(1 / (rate * period))
    for k in range(end + 1):
        if k >= begin:
            scene = machine.scene
            if (k - begin) % sample == 0:
                found.errors.append(np.inf if lost else float(np.hypot(*info["tracking_error"])))
            if (k - begin) % frame == 0:
                found.scenes.append(replace(scene, time=k * period))
        if not lost and k < end:
            _, _, lost, _, info = env.step(NO_ACTION)
        if k % 100 == 0:
            progress(100)
    return found


def draw(
    takes: list[Take], rig: Parameters, title: str, names: list[str], span: Span, rate: int, progress: Callable[[int], Any]
) -> list[Image.Image]:
    """The frames."""
    errors: list[Array] = [np.array(one.errors) for one in takes]
    seen: Array = np.concatenate(errors)
    top = 1e-3 * float(np.ceil(1.05e3 * seen[np.isfinite(seen)].max(initial=0.5e-3)))
    renderer = PairRenderer(rig, title, names, span, top)
    times = np.array([span[0] + SAMPLE * k for k in range(len(errors[0]))])
    frames = []
    for k, scenes in enumerate(zip(*(one.scenes for one in takes), strict=True)):
        until = round(k / rate / SAMPLE) + 1
        frames.append(Image.fromarray(renderer.frame(scenes, times[:until], [error[:until] for error in errors])))
        progress(1)
    return frames


def save(frames: list[Image.Image], rate: int, path: Path) -> None:
    """Write an endless animation."""
    durations = [round(1000 / rate)] * (len(frames) - 1) + [round(1000 * PAUSE)]
    options: dict[str, Any] = {
        "format": path.suffix[1:], "save_all": True, "append_images": frames[1:], "duration": durations, "loop": 0,
    }  # fmt: skip
    if path.suffix == ".webp":
        with whole_file(path) as file:
            frames[0].save(file, lossless=True, method=4, **options)
    else:
        # One palette for all frames, from ten of them: with one each, areas that do not move would flicker.
        some = [np.asarray(frame) for frame in frames[:: max(1, len(frames) // 10)]]
        palette = Image.fromarray(np.concatenate(some)).quantize(255)
        still = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
        with whole_file(path) as file:
            still[0].save(file, **{**options, "append_images": still[1:]})


def _animate(arguments: argparse.Namespace) -> None:
    path, span = arguments.out, (arguments.begin, arguments.end)
    if path.suffix not in (".webp", ".gif"):
        raise ValueError(f"--out {str(path)!r}; allowed: a file that ends in .webp or .gif")
    rig = load_parameters(arguments.parameters)
    check_environment(arguments.env)
    make = partial(
        gymnasium.make, arguments.env, parameters=rig, sensors=arguments.sensors, randomize=RANDOMIZE[arguments.randomize],
        policy_period=rig.electronics.control_period, **environment_parts(arguments),
    )  # fmt: skip
    longest = make().get_wrapper_attr("duration")
    if not 0 <= span[0] < span[1] <= longest or span[1] - span[0] < 1:
        raise ValueError(f"--begin {span[0]:g} --end {span[1]:g}; allowed: from 0 to {longest:g} s, a second apart or more")
    names = with_options(arguments.controller, arguments.set)
    options = [{"policy": policy_of(arguments.env)} if name == "residual" else {} for name in names]
    laws = [driving(make_controller(name, rig, **own), name) for name, own in zip(names, options, strict=True)]
    print(described(rig, RANDOMIZE[arguments.randomize], arguments.sensors))
    steps = round(span[1] / rig.electronics.control_period)
    with tqdm(total=2 * steps, desc="running", unit=" periods", leave=False) as bar:
        takes = [take(make(actuation=law), arguments.seed, span, arguments.rate, bar.update) for law in laws]
    title = f"{takes[0].scenes[0].title}, in real time"
    with tqdm(total=len(takes[0].scenes), desc="drawing", unit=" frames", leave=False) as bar:
        frames = draw(takes, rig, title, names, span, arguments.rate, bar.update)
    make_folder(path.parent)
    save(frames, arguments.rate, path)
    print(f"{arguments.env}, seed {arguments.seed}, {arguments.sensors} sensors, randomised: {arguments.randomize}")
    for name, one in zip(names, takes, strict=True):
        rms, largest = 1e3 * np.sqrt(np.mean(np.square(one.errors))), 1e3 * np.max(one.errors)
        print(f"{name:28} error while it is shown: {rms:.2f} mm RMS, {largest:.2f} mm at most")
    print(f"written to {path}: {len(frames)} frames, {path.stat().st_size / 1e6:.2f} MB")
