"""``birthsim study``: the door to the project's studies, which come with a clone and not with the wheel."""

import sys
from importlib.util import find_spec


def main() -> None:
    """Hand the arguments to ``lab.engine``; without a clone say that they are not here."""
    if find_spec("lab") is None or find_spec("lab.engine.door") is None:
        if sys.argv[1:] in (["-h"], ["--help"]):
            print("usage: birthsim study ...\n\nStudies come with a clone of the project.\n\nexample: birthsim study speed")
            raise SystemExit(0)
        print("birthsim study: error: there is no package 'lab' here; allowed: in a clone of the project", file=sys.stderr)
        raise SystemExit(2)
    from lab.engine import door

    door.main(sys.argv[1:])
