"""The engine of studies: pieces are computed side by side, figures kept as one JSON file, and shown from there."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

from cyclopts import Parameter

from baselines.commands.settings import EPISODES, MANY, Processes, number, whole
from baselines.work.files import own_folder, whole_results, write_text
from baselines.work.sources import ROOT
from baselines.work.tasks import Result, Task, run_tasks
from studies.results import RESULTS, Content, provenance, written

Options = SimpleNamespace
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
    ``docs/data``, by file name; ``draw(result, folder)`` writes pictures. With ``partial`` some pieces may fail; ``timed``
    pieces are measured anew, one after another. ``allowed`` has the values of options that take no others, ``words`` the help
    of what its name does not say.
    """

    code: tuple[str, ...]
    options: dict[str, Any]
    tasks: Callable[[Options], dict[Any, Task]]
    keep: Callable[[Options, Found], Any]
    units: dict[str, str]
    show: Callable[[Content], dict[str, str]]
    draw: Callable[[Content, Path], list[Path]] = no_pictures
    partial: bool = False
    timed: bool = False
    allowed: dict[str, Sequence[str]] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)

    def settings(self, measures: str) -> type[Processes]:
        """Its options as a command's settings, whose help says what it ``measures``."""
        fields = [(name, *_option(name, default, self)) for name, default in self.options.items()]
        out = Annotated[Path | None, Parameter(help="Folder for the result, its tables and its pictures.")]
        made = make_dataclass("Settings", [*fields, ("out", out, None)], bases=(Processes,), kw_only=True)
        made.__doc__ = (
            f"Measures {measures}.\n\nWhat there is of the same settings and code is kept, so that an interrupted run goes on. "
            "Without --out the folder is out/studies/NAME, and the result is results/NAME.json too."
        )
        return made

    def measure(self, name: str, settings: Any) -> None:
        """What ``birthsim study NAME`` does."""
        options = Options(**{option: getattr(settings, option) for option in self.options})
        tasks, began = self.tasks(options), time.perf_counter()
        with ExitStack() as stack:
            folder = stack.enter_context(own_folder(settings.out or ROOT / "out" / "studies" / name))
            place = Path(stack.enter_context(tempfile.TemporaryDirectory())) if self.timed else folder
            made = provenance(self.code)
            before = sum((place / task.file()).is_file() for task in tasks.values())
            jobs = 1 if self.timed else settings.jobs
            done, failures = run_tasks(list(tasks.values()), place, jobs, name, settings.cluster)
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
            with whole_results(folder) as whole:
                for file, text in {f"{name}.json": written(content), **texts}.items():
                    write_text(whole / file, text)
                drawn = [path.name for path in self.draw(content, whole) if path.suffix == ".png"]
            if not settings.out:
                write_text(RESULTS / f"{name}.json", written(content))
        print("\n\n".join(text for file, text in texts.items() if file.endswith(".md")))
        print(f"\nwritten to {folder}/: {', '.join([f'{name}.json', *texts, *drawn])}")
        if failures:
            raise ValueError(problem)


def _option(name: str, default: Any, study: Study) -> tuple[Any, Any]:
    """Annotation and default of an option of the kind of its default."""
    several = isinstance(default, tuple)
    kind: Any = type(default[0] if several else default)
    reads = {float: number("N"), int: whole(0, 2**32 - 1) if name == "seed" else whole(1, EPISODES)}
    one = Annotated[kind, reads[kind]] if kind in reads else kind
    text = study.words.get(name, "")
    own = Parameter(choices=tuple(study.allowed.get(name, ())) or None, help=f"{text[:1].upper()}{text[1:]}." if text else None)
    many: Any = list[one]  # type: ignore[valid-type]
    return (Annotated[many, MANY, Parameter(metavar="NAME..."), own] if several else Annotated[one, own]), default
