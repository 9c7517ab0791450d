"""Walks one of the users' paths, and records which kernels it asks for: ``python -m birthsim_build.kernels.recording NAME FOLDER``.

``FOLDER`` has a library to go with, so that little is compiled on the way; ``asked.json`` and what the path writes stand there
afterwards. What a path asks for does not depend on what is found.
"""

import json
import runpy
import sys
from pathlib import Path
from typing import Any

from birthsim_build.kernels.paths import PATHS
from birthsim_env.files import write_json
from birthsim_env.gradients.source import TEXTS
from birthsim_env.physics.compiled import prebuilt


def main() -> None:
    """Entry point."""
    name, folder = sys.argv[1], Path(sys.argv[2])
    asked, find = set[str](), prebuilt.find

    def noted(kernel: Any, kinds: list[str]) -> Any:
        asked.add(prebuilt.key_of(kernel, kinds))
        return find(kernel, kinds)

    prebuilt.find, prebuilt.FOLDER = noted, folder / "prebuilt"
    path = PATHS[name]
    try:
        if callable(path):
            path()
        else:
            sys.argv = ["birthsim", *(word.format(out=folder) for word in path)]
            runpy.run_module("birthsim", run_name="__main__")
    except SystemExit as end:
        if end.code:
            raise
    keys = sorted(key for key in asked if "?" not in key)
    own = sorted({key.partition(".")[0] for key in keys} & TEXTS.keys())
    write_json(folder / "asked.json", {"keys": keys, "texts": [TEXTS[name] for name in own]})


if __name__ == "__main__":
    main()
