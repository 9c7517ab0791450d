"""What is said to be called is what runs: no function of the project runs that the definitions do not lead to."""

import sys

import pytest

from baselines.bench.pieces import evaluate_piece
from baselines.work.asked import registered
from baselines.work.calls import UNDECIDING, called_by
from birthsim_env import Parameters
from birthsim_env.physics.compiled.sources import PACKAGES, ROOT
from birthsim_env.registry import used


def functions_run(work, *arguments):
    """The project's top-level functions and classes that run, as "file:name"."""
    found = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(f"{ROOT}/"):
            file = code.co_filename.removeprefix(f"{ROOT}/")
            name = code.co_qualname.partition(".")[0]
            if file.partition("/")[0] in PACKAGES and not name.startswith("<"):
                found.add(f"{file}:{name}")

    sys.setprofile(note)
    try:
        work(*arguments)
    finally:
        sys.setprofile(None)
    return found


@pytest.mark.parametrize(
    ("controller", "environment", "world"),
    [
        ("pid", "BirthSIM/Circle-v2", {"sensors": "lab", "randomize": True}),
        ("limited:admittance-adaptive", "BirthSIM/Probe-v3", {"sensors": "honest"}),
        ("residual:circle", "BirthSIM/Circle-v2", {}),
    ],
)
def test_whatever_runs_is_reached(controller, environment, world):
    piece = controller, "", Parameters().to_dict(), environment, world, [], 0, 1
    evaluate_piece(*piece)  # which imports and compiles
    with used() as asked:
        run = functions_run(evaluate_piece, *piece)
    modules = registered(*{kind for kind, _ in asked})
    called = called_by([evaluate_piece], {entry: modules[entry] for entry in (f"{kind}={name}" for kind, name in asked)})
    assert len(run) > 50
    assert sorted(one for one in run - set(called) if not one.startswith(UNDECIDING)) == []
