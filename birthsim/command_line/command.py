"""How a command runs: its settings are read, signals are answered, and what a user can mend ends it in one line."""

import os
import re
import signal
import sys
import textwrap
import threading
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NoReturn, TypeVar, get_args, get_type_hints

from cyclopts import App, ArgumentCollection, Parameter
from cyclopts.config import Dict
from cyclopts.exceptions import CycloptsError, MissingArgumentError, UnknownOptionError, UnusedCliTokensError

from birthsim.command_line.settings import ALGORITHM, CONTROLLER, ENV, FRICTION, HAND, SENSORS, TABLE, Configured
from birthsim.command_line.start import endings

S = TypeVar("S")

AGAIN = 0.01
"""Seconds after which a signal comes again that Python could not answer where it came."""


class Ended(KeyboardInterrupt):
    """A signal asks this process to end; ``number`` is the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def program(name: str, settings: type[S], example: str = "") -> App:
    """What reads the settings of the command ``name`` and returns them; its help ends with the example."""
    about = "\n\n".join(" ".join(part.split()) for part in (settings.__doc__ or "").split("\n\n"))
    app = App(
        name=name,
        help=about,
        help_format="plaintext",
        help_epilogue=f"example: {example}" if example else None,
        default_parameter=Parameter(negative=(), negative_iterable=(), show_default=_default),
        version_flags=(),
        config=_file if issubclass(settings, Configured) else None,
        result_action="return_value",
        exit_on_error=False,
        print_error=False,
        verbose=False,
        suppress_keyboard_interrupt=False,
    )
    app["--help"].show = False
    app.default(settings)
    return app


def _default(value: Any) -> str | None:
    """A default as a user would type it; nothing of a flag, of no words and of an empty list."""
    if value is None or value is False or value == "":
        return None
    return " ".join(map(str, value)) or None if isinstance(value, list | tuple) else str(value)


def _file(app: App, commands: tuple[str, ...], options: ArgumentCollection) -> None:
    """Fill in what ``--config`` says in TOML and the command line does not."""
    for token in options["--config"].tokens:
        from birthsim_env.physics.rig.reading import read_toml  # loads the whole package

        said = read_toml("--config", token.value)
        Dict(said, source=f"--config {token.value!r}", use_commands_as_keys=False)(app, commands, options)


def perform_with(name: str, settings: type[S], action: Callable[[S], None], example: str) -> None:
    """Read the settings and act."""
    act(name, lambda: _read_and_act(program(name, settings, example), settings, action))


def _named(settings: type) -> str:
    """What has a name and a command of these settings takes, for the end of its help; "" where it takes nothing of the kind."""
    marks = [mark for hint in get_type_hints(settings, include_extras=True).values() for mark in _marks(hint)]
    if not any(mark in marks for mark in (ALGORITHM, CONTROLLER, ENV, SENSORS, HAND, TABLE)):
        return ""
    from birthsim_env.parts.scenarios import environment_id  # these load what is listed
    from birthsim_env.registry import names

    lists: list[tuple[Parameter, str, Callable[[], list[str]]]] = [
        (ALGORITHM, "algorithms", lambda: names("algorithm")),
        (CONTROLLER, "controllers", lambda: names("controller")),
        (CONTROLLER, "policies, as residual:circle", lambda: names("policy")),
        (ENV, "environments", lambda: [environment_id(name) for name in names("scenario")]),
        (SENSORS, "sensors", lambda: names("sensors")),
        (FRICTION, "frictions", lambda: names("friction")),
        (HAND, "hands", lambda: names("hand")),
        (TABLE, "endings of tables", lambda: names("reader")),
    ]
    paragraphs = [f"{title}: {', '.join(found())}" for mark, title, found in lists if mark in marks]
    return "\n".join(textwrap.fill(one, 80, break_on_hyphens=False) for one in paragraphs) + "\n\n"


def _marks(hint: Any) -> Iterator[Any]:
    """What stands in an annotation, also within a choice or a list."""
    for part in get_args(hint):
        yield part
        yield from _marks(part)


def _read_and_act(app: App, settings: type, action: Callable[[Any], None]) -> None:
    if {"--help", "-h"} & {*sys.argv[1:]}:
        app.help_epilogue = f"{_named(settings)}{app.help_epilogue or ''}"
    try:
        given = app(sys.argv[1:])
    except CycloptsError as error:
        said, option = " ".join(str(error).split()).rstrip("."), error.argument.name if error.argument else ""
        if isinstance(error, MissingArgumentError) and option not in sys.argv:
            said = f"{option} is missing"
        # A check of ours says argument and value by itself.
        said = re.sub(r'^Invalid value "[^"]*" for (--[\w-]+)\. \w+ = ', r"\1 ", said)
        place = "" if option.lstrip("-") in said else f"{option}: "
        missing = isinstance(error, MissingArgumentError | UnknownOptionError | UnusedCliTokensError)
        known = f"; allowed: what {app.name[0]} --help lists" * missing
        raise ValueError(f"{place}{said}{known}") from None
    if given is not None:  # help was asked for
        action(given)


def act(name: str, action: Callable[[], None]) -> None:
    """Act, and turn what a user can mend into one line and exit status 2; a signal of ``endings`` into 128 + its number.

    SIGTERM and SIGHUP end a command as Ctrl-C does: what is complete is kept, and no process or half a file stays behind.
    """
    came: list[int] = []
    words, said = endings(), False

    def end(number: int, _: object) -> None:
        came.append(number)
        if len(came) > 1:
            if not said:
                os.write(2, f"{name}: {words[number]}\n".encode())
            os._exit(128 + number)
        raise Ended(number)

    def lost(where: Any) -> None:
        if not isinstance(where.exc_value, Ended):
            report(where)
            return
        # It came in a destructor or a callback of the interpreter's, which no exception leaves: it comes again after that.
        came.clear()
        again.append(threading.Timer(AGAIN, _send, [where.exc_value.number]))
        again[-1].daemon = True
        again[-1].start()

    again: list[threading.Timer] = []
    before = {number: signal.signal(number, end) for number in words}
    report, sys.unraisablehook = sys.unraisablehook, lost
    try:
        with warnings.catch_warnings():
            warnings.showwarning = partial(_warn, name, warnings.showwarning)
            action()
    except KeyboardInterrupt as error:
        number, said = error.number if isinstance(error, Ended) else int(signal.SIGINT), True
        _say(name, words[number], 128 + number)
    except Exception as error:
        if came:
            # Compiled code, in which the signal came, has made another error of it, and may not be fit to be left in order.
            os.write(2, f"{name}: {words[came[0]]}\n".encode())
            os._exit(128 + came[0])
        _say(name, _problem(error), 2)
    finally:
        for timer in again:
            timer.cancel()
        # After a signal the process ends, and another one ends it at once.
        if not came:
            sys.unraisablehook = report
            for number, handler in before.items():
                signal.signal(number, handler)


def _send(number: int) -> None:
    """A signal for the main thread, also where that waits for something."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        signal.raise_signal(number)


def _warn(name: str, before: Callable[..., None], message: Warning | str, category: type[Warning], *where: Any) -> None:
    """What a user should know in one line, as errors are, without the line of source code; other warnings as they come."""
    if category is UserWarning:
        print(f"{name}: warning: {_short(str(message))}", file=sys.stderr)
    else:
        before(message, category, *where)


def _short(words: str) -> str:
    """``words`` without the middle of what a user gave that is longer than any name; a message may say it twice."""
    return re.sub(r"\S{301,}", lambda run: f"{run[0][:120]} ... {run[0][-120:]}", words)


def _problem(error: Exception) -> str:
    """What a user can mend; anything else is raised again."""
    if isinstance(error, ValueError):
        return f"error: {error}"
    if isinstance(error, OSError):
        place = "" if error.filename is None else f"{str(error.filename)!r}: "
        return f"error: {place}{error.strerror or error}"
    if isinstance(error, MemoryError):
        return "error: out of memory; allowed: fewer lanes, episodes or jobs"
    raise error


def _say(name: str, words: str, status: int) -> NoReturn:
    print(f"{name}: {_short(words)}", file=sys.stderr)
    raise SystemExit(status) from None
