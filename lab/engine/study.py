"""The engine of studies: pieces are computed side by side, figures kept as one JSON file, and shown from there."""

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

from baselines.work.asked import asked
from baselines.work.tasks import Result, Task, is_kept, run_tasks
from birthsim.command_line.settings import EPISODES, MANY, Processes, number, whole
from birthsim_env.files import own_folder, whole_results, write_text
from birthsim_env.physics.compiled.sources import ROOT
from lab.engine.results import RESULTS, Content, beginning, provenance, written

Options = SimpleNamespace
Found = Mapping[Any, Result]


def as_found(options: Options, found: Found) -> Any:
    """Of a study whose values are its pieces' results by key."""
    return dict(found)


def the_only_one(options: Options, found: Found) -> Any:
    """Of a study with one piece."""
    (result,) = found.values()
    return result


def no_texts(content: Content) -> dict[str, str]:
    """Of a study that is shown by pictures alone."""
    return {}


def no_pictures(content: Content, folder: Path) -> list[Path]:
    """Of a study that is shown by tables alone."""
    return []


def no_more(options: Options, found: Found) -> dict[Any, Task]:
    """Of a study whose pieces are known beforehand."""
    return {}


def no_files(options: Options, found: Found, folder: Path) -> list[str]:
    """Of a study that writes nothing but its result, texts and pictures."""
    return []


@dataclass(frozen=True)
class Study:
    """What is run, over which grid, what is kept of it, and how it is shown.

    ``options`` has the default of each option; a tuple takes several values. ``tasks(options)`` are the pieces by key,
    ``keep(options, results by key)`` the figures, as JSON takes them, whose ``units`` are given by column. ``show(result)`` are
    the texts that stand in ``docs/data``, by file name; ``draw(result, folder)`` writes pictures. With ``partial`` some pieces
    may fail; ``timed`` pieces are measured anew, one after another. ``allowed`` has the values of options that take no others,
    ``words`` the help of what its name does not say; the option ``first`` needs no name. ``further(options, results by key)``
    are pieces that others suggest, until there are none; ``write(options, results by key, folder)`` writes more files and names
    them.

    A result is fresh while all that ``tasks``, ``keep`` and ``further`` call is as it was, what they call by name, and the
    entries of the registry that they asked for. ``beside`` are functions and classes that measure too, but that none of them
    names, such as an environment of ``agents`` that is made by its id.

    Options that are ``places`` name a folder of the user's with measured data, which are not the project's to keep. A result
    does not hold such a path, and ``birthsim study renew`` leaves the study to who has the data.
    """

    options: dict[str, Any]
    tasks: Callable[[Options], dict[Any, Task]]
    keep: Callable[[Options, Found], Any] = as_found
    units: dict[str, str] = field(default_factory=dict)
    show: Callable[[Content], dict[str, str]] = no_texts
    draw: Callable[[Content, Path], list[Path]] = no_pictures
    partial: bool = False
    timed: bool = False
    allowed: dict[str, Sequence[str]] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    first: str = ""
    further: Callable[[Options, Found], dict[Any, Task]] = no_more
    write: Callable[[Options, Found, Path], list[str]] = no_files
    beside: tuple[Callable[..., Any], ...] = ()
    places: tuple[str, ...] = ()

    @property
    def measuring(self) -> tuple[Callable[..., Any], ...]:
        """The functions whose code decides what is kept."""
        return (self.tasks, self.keep, self.further, *self.beside)

    def kept_settings(self, options: dict[str, Any]) -> dict[str, Any]:
        """What a result says of its options."""
        return {name: value for name, value in options.items() if name not in self.places}

    def settings(self, measures: str) -> type[Processes]:
        """Its options as a command's settings, whose help says what it ``measures``."""
        fields = [
            (name, _option(name, default, self), field(default=default, kw_only=name != self.first))
            for name, default in self.options.items()
        ]
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
        began, kept = time.perf_counter(), 0
        tasks, found, failures = dict[Any, Task](), dict[Any, Result](), dict[str, str]()
        more, jobs = self.tasks(options), 1 if self.timed else settings.jobs
        with ExitStack() as stack:
            folder = stack.enter_context(own_folder(settings.out or ROOT / "out" / "studies" / name))
            place = Path(stack.enter_context(tempfile.TemporaryDirectory())) if self.timed else folder
            begun = beginning()
            while more:
                kept += sum(is_kept(task, place) for task in more.values())
                each = {task.name: task for task in more.values()}
                done, failed = run_tasks(list(each.values()), place, jobs, name, settings.cluster)
                tasks, failures = tasks | more, failures | failed
                found |= {key: done[task.name] for key, task in more.items() if task.name in done}
                more = {} if failures else self.further(options, found)
            problem = f"{len(failures)} of {len(tasks)} pieces failed, the first {': '.join(next(iter(failures.items()), ()))}"
            if failures and not (self.partial and found):
                raise ValueError(problem)
            figures = self.keep(options, found)
            content = {
                **provenance(begun, self.measuring, asked()),
                "seconds": round(time.perf_counter() - began, 1),
                "pieces": len(tasks),
                "pieces_kept": kept,
                "failed": failures,
                "settings": self.kept_settings(vars(options)),
                "units": self.units,
                "figures": figures,
            }
            content = json.loads(written(content))
            texts = self.show(content)
            with whole_results(folder) as whole:
                for file, text in {f"{name}.json": written(content), **texts}.items():
                    write_text(whole / file, text)
                drawn = [path.name for path in self.draw(content, whole) if path.suffix == ".png"]
                drawn += self.write(options, found, whole)
            if not settings.out:
                write_text(RESULTS / f"{name}.json", written(content))
        print("\n\n".join(text.replace("**", "") for file, text in texts.items() if file.endswith(".md")))
        print(f"\nwritten to {folder}/: {', '.join([f'{name}.json', *texts, *drawn])}")
        if failures:
            raise ValueError(problem)


def _option(name: str, default: Any, study: Study) -> Any:
    """Annotation of an option of the kind of its default."""
    several = isinstance(default, tuple)
    kind: Any = type(default[0] if several else default)
    reads = {float: number("N"), int: whole(0, 2**32 - 1) if name == "seed" else whole(1, EPISODES)}
    one = Annotated[kind, reads[kind]] if kind in reads else kind
    text = study.words.get(name, "")
    own = Parameter(choices=tuple(study.allowed.get(name, ())) or None, help=f"{text[:1].upper()}{text[1:]}." if text else None)
    many: Any = list[one]  # type: ignore[valid-type]
    return Annotated[many, MANY, Parameter(metavar="NAME..."), own] if several else Annotated[one, own]
