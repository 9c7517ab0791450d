"""``birthsim study soak``: 10^8 policy steps over all scenarios, laws, sensors and corners of the ranges, on one thread.

Every lap is written as it ends; interrupted (Ctrl-C), the same command carries on. It exits with 1 where an observation,
reward or state was not finite or outside its space, or where memory grew.
"""

import json
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tqdm import tqdm

from baselines.work.asked import registered
from baselines.work.side_by_side import ONE_THREAD
from baselines.work.tasks import code_stamp
from birthsim.command_line.settings import Configured, Seed, whole
from birthsim_env.files import make_folder, write_text
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.registry import register
from lab.engine.alone import only_under
from lab.studies.soak.laps import LANES, STEPS, run

GROWTH = 10.0
"""MB by which the last tenth of a soak may need more than the sixth; by then all kernels are loaded."""

Laps = list[dict[str, Any]]


def stored(path: Path, setting: dict[str, Any]) -> Laps:
    """The laps of an interrupted soak; ``ValueError`` where the file is of another."""
    if not path.is_file():
        write_text(path, json.dumps(setting) + "\n")
        return []
    head, *lines = path.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True) or [""]
    if parse_json(f"laps = {str(path)!r}", head, dict) != setting:
        raise ValueError(f"{path} is of other code or another seed; allowed: another --out")
    # A kill leaves half a line at the end.
    whole = [line for line in lines if line.endswith("\n")]
    if len(whole) < len(lines):
        write_text(path, head + "".join(whole))
    return [parse_json(f"laps = {str(path)!r}", line, dict) for line in whole]


def growth(laps: Laps) -> float:
    """MB between the sixth tenth of the laps and the last, medians; 0 where they are few."""
    tenths = [np.median(part) for part in np.array_split([lap["rss"] for lap in laps], 10)] if len(laps) >= 20 else [0.0] * 10
    return float(tenths[-1] - tenths[5])


def table(laps: Laps) -> str:
    """Markdown: steps, episodes and faults by scenario and by what controls."""
    lines = ["| experiment | policy steps | episodes ended by the rig | by the clock | faults |", "|---|---|---|---|---|"]
    for key in ("scenario", "control"):
        groups: dict[str, Laps] = defaultdict(list)
        for lap in laps:
            groups[lap[key]].append(lap)
        for name, own in sorted(groups.items()):
            sums = [sum(lap[column] for lap in own) for column in ("steps", "terminated", "truncated")]
            lines.append(
                f"| {name} | {' | '.join(f'{number:,}' for number in sums)} | {sum(len(lap['faults']) for lap in own)} |"
            )
    return "\n".join(lines)


@dataclass(kw_only=True)
class Settings(Configured):
    """Run policy steps over all that there is; interrupted, the same command carries on."""

    steps: Annotated[int, whole()] = 10**8
    """Policy steps."""
    seed: Seed = 0
    out: Path = Path("out/soak")
    """Folder for laps.jsonl, which the same command goes on from."""


@register(study="soak", about="10^8 policy steps over all that there is")
def main(settings: Settings) -> None:
    """Run the laps that are missing."""
    only_under(ONE_THREAD)
    code = code_stamp(run, registered("controller", "sensors", "scenario", "hand"))
    setting = {"seed": settings.seed, "lanes": LANES, "steps": STEPS, "code": code}
    journal = make_folder(settings.out) / "laps.jsonl"
    laps = stored(journal, setting)
    wanted = -(-settings.steps // (LANES * STEPS))
    done = sum(lap["steps"] for lap in laps)
    try:
        with (
            tqdm(total=wanted * LANES * STEPS, initial=done, unit=" steps", unit_scale=True) as bar,
            journal.open("a", encoding="utf-8") as file,
        ):
            for number in range(len(laps), wanted):
                lap = run(number, settings.seed, progress=bar.update).to_dict()
                file.write(json.dumps(lap) + "\n")
                file.flush()
                laps.append(lap)
                bar.n = sum(one["steps"] for one in laps)
                for fault in lap["faults"]:
                    bar.write(f"lap {number}, {lap['scenario']}, {lap['control']}: {fault}", file=sys.stderr)
    except KeyboardInterrupt:
        print(f"interrupted: {len(laps)} of {wanted} laps are kept; the same command carries on", file=sys.stderr)
    print(table(laps))
    print(f"memory grew by {growth(laps):.1f} MB from the sixth tenth of the laps to the last")
    if growth(laps) > GROWTH or any(lap["faults"] for lap in laps):
        raise SystemExit(1)
