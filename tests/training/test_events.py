"""Events of a training that goes on: programs that read them see the points in the order in which they were written."""

from agents.training.events import EVENTS, FILES, RUN, Events
from tests.training.left import events_left


def session(folder, sizes, points):
    """Write points (steps) in a session of its own, which a checkpoint follows; the sizes that it has."""
    events = Events(folder, sizes)
    for steps in points:
        events.add({"value": float(steps)}, steps)
    sizes = events.sizes()
    events.add({"value": -1.0}, 1000)  # what no checkpoint has
    events.close()
    return sizes


def test_points_keep_their_order_when_the_clock_is_set_back(tmp_path):
    sizes = {}
    for k in range(4):
        sizes = session(tmp_path, sizes, (2 * k, 2 * k + 1))
        (newest,) = (tmp_path / EVENTS / RUN).glob(FILES)
        # As if it had been begun later than all that follow.
        later = f"{FILES[:-1]}999999999{9 - k}.host.1.0"
        newest.rename(newest.with_name(later))
        sizes[later] = sizes.pop(newest.name)
    Events(tmp_path, sizes).close()
    assert events_left(tmp_path) == {"value": [(k, float(k)) for k in range(8)]}


def test_files_of_a_session_that_died_before_its_checkpoint_keep_their_points(tmp_path):
    """A session gives numbers to older files; a checkpoint that was written before knows them without."""
    sizes = session(tmp_path, {}, (0, 1))
    for _ in range(3):
        session(tmp_path, sizes, (7,))
    Events(tmp_path, sizes).close()
    assert events_left(tmp_path) == {"value": [(0, 0.0), (1, 1.0)]}
