"""The results of all studies: which are stale, what shows them, and their renewal."""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from birthsim.command_line.command import perform_with
from birthsim.command_line.settings import Configured, Style
from birthsim_env.files import make_folder, write_text
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import entry
from lab.engine.door import OWN, studies
from lab.engine.results import changed, read_result
from lab.engine.study import Study

DATA = ROOT / "docs" / "data"
ELSEWHERE = {
    "reference_returns.json": ROOT / "birthsim_env" / "scores.json",
    "scale.json": ROOT / "birthsim" / "benchmark" / "scale.json",
    "scale_rail.json": ROOT / "birthsim" / "benchmark" / "scale_rail.json",
}
"""Texts that do not stand in ``DATA``."""

_PICTURE = re.compile(r"\]\((?:\.\./)*(\w+\.svg)\)")


def main() -> None:
    """Entry point of ``birthsim study NAME`` for declared studies, and of ``OWN``."""
    command = sys.argv[0]
    name = command.rpartition(" ")[2]
    if name in OWN:
        does = f"{OWN[name][0].upper()}{OWN[name][1:]}."
        if name == "draw":
            perform_with(command, Drawing, lambda settings: draw(settings.style), "")
            return
        action = {"status": status, "render": render, "renew": renew}[name]
        perform_with(command, type("Settings", (Configured,), {"__doc__": does}), lambda _: action(), "")
    else:
        study = declared(name)
        perform_with(command, study.settings(studies()[name].about), partial(study.measure, name), "")


@dataclass(kw_only=True)
class Drawing(Configured):
    """Draw the pictures of docs from results/*.json; for a paper all figures, into out/paper."""

    style: Style = "screen"


def declared(name: str) -> Study:
    """The declaration of a study."""
    import_module(f"lab.studies.{studies()[name].module}")
    return cast(Study, entry("study", name).made)


def names() -> list[str]:
    """The declared studies."""
    return [name for name, study in studies().items() if not study.is_command]


def state(name: str) -> str:
    """Whether the result of a study is of the sources that are here."""
    study, content = declared(name), read_result(name)
    if content is None:
        return "not measured yet"
    files = changed(content, study.measuring)
    listed = ", ".join(files[:3]) + (f" and {len(files) - 3} more" if len(files) > 3 else "")
    usual = json.loads(json.dumps(study.kept_settings(study.options)))
    other = {key: value for key, value in content["settings"].items() if key not in usual or value != usual[key]}
    said = "".join(_unlike(key, value, usual.get(key)) for key, value in other.items())
    return (f"stale; changed: {listed}" if files else "fresh") + said


def _unlike(option: str, measured: Any, usual: Any) -> str:
    """How a result's option differs from the one that a run has now: one that came after it is lacking, which is not stale."""
    if isinstance(measured, list) and isinstance(usual, list) and all(one in usual for one in measured):
        return f"; lacks {', '.join(str(one) for one in usual if one not in measured)}"
    return f"; {shown(option)} = {shown(measured)}, not {'an option' if usual is None else usual}"


def status() -> None:
    """Print the state of each result, its date, its commit and its seconds."""
    width = max(map(len, names())) + 2
    for name in names():
        content = read_result(name)
        made = f"{content['date'][:10]}  {content['commit'][:7]}  {content['seconds']:8.0f} s  " if content else ""
        print(f"{name:{width}}{made}{state(name)}")


def texts(name: str) -> Iterator[tuple[Path, str]]:
    """What shows the result of a study: files, and what should stand in them."""
    if (content := read_result(name)) is not None:
        for file, text in declared(name).show(content).items():
            yield ELSEWHERE.get(file, DATA / file), text


def rendered() -> dict[Path, str]:
    """Every file that shows results, and what should stand in it."""
    return {path: text for name in names() for path, text in texts(name)}


def render() -> None:
    """Write what differs."""
    for path, text in rendered().items():
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_text(path, text)
            print(path.relative_to(ROOT))


def draw(style: str = "screen") -> None:
    """Draw the pictures of every result that a page of docs shows, or those of all for a paper, into out/paper."""
    # pyplot takes half a second to load.
    from baselines.figures.style import drawn_for

    if style == "paper":
        folder = make_folder(ROOT / "out" / "paper")
        with drawn_for(style):
            for name in names():
                for drawn in declared(name).draw(content, folder) if (content := read_result(name)) else ():
                    print(drawn.relative_to(ROOT))
        return
    pages = [page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md")]
    shown = {picture for text in pages for picture in _PICTURE.findall(text)}
    for name in names():
        if (content := read_result(name)) is not None:
            with tempfile.TemporaryDirectory() as place:
                for path in declared(name).draw(content, Path(place)):
                    if path.name in shown:
                        shutil.copy(path, ROOT / "docs")


def renew() -> None:
    """Run what is not fresh or was measured with other settings, each with its own defaults."""
    for name in names():
        if state(name) != "fresh":
            if asked := declared(name).places:
                options = " ".join(f"--{option} FOLDER" for option in asked)
                print(f"{name} is left as it is: it needs measured data, birthsim study {name} {options}")
            else:
                subprocess.run([sys.executable, "-m", "birthsim", "study", name], check=True, cwd=ROOT)
