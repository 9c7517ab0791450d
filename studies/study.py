"""The engine of studies: pieces are computed side by side, figures kept as one JSON file, and shown from there."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from baselines.commands.shared import EPISODES, JOBS, add_processes, finite_number, run, seed_number, whole_up_to
from baselines.work.files import own_folder, whole_results, write_text
from baselines.work.sources import ROOT
from baselines.work.tasks import Result, Task, run_tasks
from studies.results import RESULTS, Content, provenance, written

Options = argparse.Namespace
Found = Mapping[Any, Result]


def no_pictures(content: Content, folder: Path) -> list[Path]:
    """Of a study that is shown by tables alone."""
    return []


@dataclass(frozen=True)
class Study:
    """What is run, over which grid, what is kept of it, and how it is shown.

    ``code`` names the modules that measure: a result is fresh while their sources are as they were. ``options`` has the default
    of each option; a tuple takes several values. ``tasks(options)`` are the pieces by key, ``keep(options, results by key)``
    the figures, as JSON takes them, whose ``units`` are given by column. ``show(result)`` are the texts that stand in
    ``docs/data``, by file name; ``draw(result, folder)`` writes pictures. With ``partial`` some pieces may fail.
    ``allowed`` has the values of options that take no others, ``words`` the help of what its name does not say.
    """

    code: tuple[str, ...]
    options: dict[str, Any]
    tasks: Callable[[Options], dict[Any, Task]]
    keep: Callable[[Options, Found], Any]
    units: dict[str, str]
    show: Callable[[Content], dict[str, str]]
    draw: Callable[[Content, Path], list[Path]] = no_pictures
    partial: bool = False
    allowed: dict[str, Sequence[str]] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)

    def main(self, name: str, measures: str) -> None:
        """Entry point of ``birthsim study NAME``, whose help says what it ``measures``."""
        parser = argparse.ArgumentParser(
            prog=f"birthsim study {name}", description=f"Measures {measures}.",
            epilog="What there is of the same settings and code is kept, so that an interrupted run goes on. "
            f"Without --out the folder is out/studies/{name}, and the result is results/{name}.json too.",
        )  # fmt: skip
        for option, default in self.options.items():
            allowed = self.allowed.get(option, ())
            parts = [self.words.get(option, ""), f"of {', '.join(allowed)}" if allowed else ""]
            parts += ["(default: %(default)s)"] if default != "" else []
            _add(parser, option, default, " ".join(filter(None, parts)), allowed or None)
        add_processes(parser)
        parser.add_argument("--out", type=Path, help="folder for the result, its tables and its pictures")
        run(parser, lambda arguments: self._measure(name, arguments))

    def _measure(self, name: str, arguments: argparse.Namespace) -> None:
        options = Options(**{option: getattr(arguments, option) for option in self.options})
        tasks, began = self.tasks(options), time.perf_counter()
        with own_folder(arguments.out or ROOT / "out" / "studies" / name) as folder:
            made = provenance(self.code)
            before = sum((folder / task.file()).is_file() for task in tasks.values())
            done, failures = run_tasks(list(tasks.values()), folder, arguments.jobs or JOBS, name, arguments.cluster)
            problem = f"{len(failures)} of {len(tasks)} pieces failed, the first {': '.join(next(iter(failures.items()), ()))}"
            if failures and not (self.partial and done):
                raise ValueError(problem)
            figures = self.keep(options, {key: done[task.name] for key, task in tasks.items() if task.name in done})
            content = {
                **made, "seconds": round(time.perf_counter() - began, 1), "pieces": len(tasks), "pieces_kept": before,
                "failed": failures, "settings": vars(options), "units": self.units, "figures": figures,
            }  # fmt: skip
            content = json.loads(written(content))
            texts = self.show(content)
            with whole_results(folder) as place:
                for file, text in {f"{name}.json": written(content), **texts}.items():
                    write_text(place / file, text)
                drawn = [path.name for path in self.draw(content, place) if path.suffix == ".png"]
            if not arguments.out:
                write_text(RESULTS / f"{name}.json", written(content))
        print("\n\n".join(text for file, text in texts.items() if file.endswith(".md")))
        print(f"\nwritten to {folder}/: {', '.join([f'{name}.json', *texts, *drawn])}")
        if failures:
            raise ValueError(problem)


def _add(parser: argparse.ArgumentParser, option: str, default: Any, words: str, allowed: Sequence[str] | None) -> None:
    """An option of the kind of its default."""
    flag, several = f"--{option.replace('_', '-')}", isinstance(default, tuple)
    if isinstance(default, bool):
        parser.add_argument(flag, action="store_true", help=words.partition("(")[0])
        return
    kinds: dict[type, Any] = {float: finite_number, int: seed_number if option == "seed" else whole_up_to(EPISODES)}
    kind = kinds.get(type(default[0] if several else default), str)
    own: dict[str, Any] = (
        {"nargs": "+", "help": words % {"default": " ".join(map(str, default))}} if several else {"help": words}
    )
    parser.add_argument(flag, type=kind, default=default, choices=allowed, metavar="NAME" if kind is str else "N", **own)
