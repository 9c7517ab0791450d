"""What the study of the installed package takes from pages, and which files it makes for a command."""

import pytest

from lab.studies.installed.inputs import MADE, NEEDS, TEXTS, classes, lacking
from lab.studies.installed.pages import commands, pages

PAGE = """
Text, and `birthsim run` within it.

    birthsim run --out out/run    # a comment
    birthsim export --to onnx circle --out circle.onnx && python examples/onnx_policy.py circle.onnx
    birthsim study speed

```
birthsim drive \\
  --rig true.toml
```

```toml
birthsim live
```

    pip install numpy
"""


def test_a_page_s_commands_are_read_without_comments_and_those_of_a_clone():
    assert [" ".join(one) for one in commands(PAGE)] == [
        "birthsim run --out out/run",
        "birthsim export --to onnx circle --out circle.onnx",
        "python examples/onnx_policy.py circle.onnx",
        "birthsim drive --rig true.toml",
    ]


def test_every_page_with_commands_is_read():
    shown = {page.name for page in pages() if commands(page.read_text(encoding="utf-8"))}
    assert {"README.md", "benchmark.md", "rail.md", "real_rig.md"} <= shown


@pytest.mark.parametrize(
    ("command", "named"),
    [
        ("birthsim identify log.csv --out rig.toml", ["log.csv"]),
        ("birthsim live --controller mine.py:Law", ["mine.py"]),
        ("birthsim live --policy out/circle", ["out/circle"]),
        ("birthsim train --config circle --out out/circle", []),
        ("birthsim score policy.zip --env BirthSIM/Circle-v2", ["policies.py", "policy.zip"]),
        ("birthsim evaluate --parameters examples/rail_rig.toml", []),
    ],
)
def test_files_that_a_user_has_are_made(tmp_path, command, named):
    assert lacking(command.split(), tmp_path) == named
    for name in named:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert lacking(command.split(), tmp_path) == []


def test_everything_that_is_needed_can_be_made():
    known = {**TEXTS, **MADE, **classes()}
    assert [one for needed in NEEDS.values() for one in needed if one not in known] == []
