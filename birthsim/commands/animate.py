"""birthsim animate: two controllers in the same world beside each other, as an animated picture in real time."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter
from PIL import Image
from tqdm import tqdm

from baselines.driving import NO_ACTION
from birthsim.command_line.settings import CONTROLLER, RANDOMIZE, Env, Parts, Randomize, RigFile, Seed, Sensors, Set, number
from birthsim.command_line.worlds import check_environment, with_options
from birthsim.recorded import driven
from birthsim_env.drawing.scene import Scene
from birthsim_env.files import make_folder, whole_file
from birthsim_env.ids import rig_for
from birthsim_env.parts.drawn.randomization import described
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

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


@dataclass(kw_only=True)
class Settings(Parts):
    """Two controllers beside each other on the same rig under the same hand, in real time: linkage, magnifier (the same for
    both) and error from the compliant target.
    """

    env: Env = "BirthSIM/Forceps-v2"
    controller: Annotated[tuple[str, str], CONTROLLER, Parameter(alias="--controllers", metavar="NAME NAME")] = (
        "backstepping",
        "admittance-backstepping",
    )
    """Two names or path/to/file.py:Class; residual is the shipped policy of the environment."""
    set: Set = field(default_factory=list)
    seed: Seed = 0
    """Seed of the world."""
    sensors: Sensors = "ideal"
    randomize: Randomize = "all"
    """What the seed draws at random."""
    parameters: RigFile = None
    begin: Annotated[float, number("S")] = 0.5
    """Time of the episode at which the film begins."""
    end: Annotated[float, number("S")] = 6.5
    """Time of the episode at which the film ends."""
    rate: Annotated[Literal[10, 20, 25, 50], Parameter(metavar="HZ")] = 25
    """Frames per second: the period is a whole number of the 10 ms that a GIF counts in."""
    out: Path
    """File to write, .webp or .gif."""


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
    from birthsim_env.drawing.pair import Pair  # late: it loads pygame

    pair = Pair(rig, title, names, span, top)
    times = np.array([span[0] + SAMPLE * k for k in range(len(errors[0]))])
    frames = []
    for k, scenes in enumerate(zip(*(one.scenes for one in takes), strict=True)):
        until = round(k / rate / SAMPLE) + 1
        frames.append(Image.fromarray(pair.frame(scenes, times[:until], [error[:until] for error in errors])))
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


def main(settings: Settings) -> None:
    """Run both, draw them, write the animation."""
    path, span = settings.out, (settings.begin, settings.end)
    if path.suffix not in (".webp", ".gif"):
        raise ValueError(f"--out {str(path)!r}; allowed: a file that ends in .webp or .gif")
    rig = rig_for(settings.env, settings.parameters)
    check_environment(settings.env)
    names, randomize = with_options(settings.controller, settings.set), RANDOMIZE[settings.randomize]
    envs = [
        driven(settings.env, name, rig, sensors=settings.sensors, randomize=randomize, **settings.parts()) for name in names
    ]
    longest = envs[0].get_wrapper_attr("duration")
    if not 0 <= span[0] < span[1] <= longest or span[1] - span[0] < 1:
        raise ValueError(f"--begin {span[0]:g} --end {span[1]:g}; allowed: from 0 to {longest:g} s, a second apart or more")
    print(described(rig, randomize, settings.sensors))
    steps = round(span[1] / rig.electronics.control_period)
    with tqdm(total=2 * steps, desc="running", unit=" periods", leave=False) as bar:
        takes = [take(env, settings.seed, span, settings.rate, bar.update) for env in envs]
    title = f"{takes[0].scenes[0].title}, in real time"
    with tqdm(total=len(takes[0].scenes), desc="drawing", unit=" frames", leave=False) as bar:
        frames = draw(takes, rig, title, names, span, settings.rate, bar.update)
    make_folder(path.parent)
    save(frames, settings.rate, path)
    print(f"{settings.env}, seed {settings.seed}, {settings.sensors} sensors, randomised: {settings.randomize}")
    for name, one in zip(names, takes, strict=True):
        rms, largest = 1e3 * np.sqrt(np.mean(np.square(one.errors))), 1e3 * np.max(one.errors)
        print(f"{name:28} error while it is shown: {rms:.2f} mm RMS, {largest:.2f} mm at most")
    print(f"written to {path}: {len(frames)} frames, {path.stat().st_size / 1e6:.2f} MB")
