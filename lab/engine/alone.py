"""Studies that need a process whose packages are imported under settings of their own."""

import os
import sys


def only_under(settings: dict[str, str], module: str = "") -> None:
    """Begin anew with these variables, unless they are as they should be; or go on as ``python -m module`` with them.

    Imports of this process are gone then; the arguments stay.
    """
    if module or any(os.environ.get(name) != value for name, value in settings.items()):
        words = [module] if module else ["birthsim", *sys.argv[0].split()[1:]]
        os.execve(sys.executable, [sys.executable, "-m", *words, *sys.argv[1:]], os.environ | settings)
