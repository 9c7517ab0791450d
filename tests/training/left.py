"""What a training leaves besides its policy, without clocks: the content of its checkpoint, and the points of its events."""

import json
import math

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from agents.policy.sealed import unsealed
from agents.training.checkpoint import FORMAT, NAME
from birthsim_env.state import PLAIN

CLOCKS = {"seconds", "environment_fraction", "split"}
"""Keys that say how long things took."""

SPEED = "time/fps"
"""The only event whose values do."""


def checkpoint_left(folder):
    """What the checkpoint in a folder holds, as dictionaries, lists and text, in which NaN is NaN."""
    arrays, about = unsealed((folder / NAME).read_bytes(), FORMAT)
    content = _plain(about["content"], arrays)
    assert sum(content["past"].pop("events").values()) > 0
    return content


def _plain(value, arrays):
    if isinstance(value, list):
        return [_plain(one, arrays) for one in value]
    if not isinstance(value, dict):
        return _same(value)
    if "array" in value:
        array = arrays[value["array"]]
        if value["array"].endswith(f"lanes/{PLAIN}"):
            # Gymnasium's generator has its seed from the system, and is not asked: each lane has a seed of its own. None is
            # what a first step will make.
            return {name: one for name, one in json.loads(array.tobytes()).items() if name != "random" and one is not None}
        return str(array.dtype), array.shape, array.tobytes()
    return {key: _plain(one, arrays) for key, one in value["dict"] if key not in CLOCKS}


def events_left(folder):
    """Tag -> the points (step, value) of all runs, in the order in which they were written; nothing is purged."""
    points = {}
    for run in sorted((folder / "tensorboard").iterdir()):
        accumulator = EventAccumulator(str(run), size_guidance={"scalars": 0}, purge_orphaned_data=False)
        accumulator.Reload()
        for tag in accumulator.Tags()["scalars"]:
            own = [(one.step, None if tag == SPEED else _same(one.value)) for one in accumulator.Scalars(tag)]
            points.setdefault(tag, []).extend(own)
    assert points
    return points


def _same(value):
    """A number that equals itself."""
    return "nan" if isinstance(value, float) and math.isnan(value) else value
