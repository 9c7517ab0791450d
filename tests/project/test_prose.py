"""What reads the prose: it knows the glossary's names and finds a long sentence."""

import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
TEXTLINT = ROOT / "out" / "npm" / "node_modules" / ".bin" / "textlint"
UNREAD = "<!-- textlint-disable -->\n\nA title with set points.\n\n<!-- textlint-enable -->\n"
CONFIGURATION = ROOT / "docs" / "_prose" / ".textlintrc.js"


@pytest.mark.skipif(not TEXTLINT.exists() and os.environ.get("CI") != "true", reason="make prose installs textlint")
def test_other_names_and_long_sentences_are_found(tmp_path):
    long = "word " * 45
    (tmp_path / "page.md").write_text(
        f"The `set point` is code.\n\nSet points have one name.\n\nA {long.strip()}.\n\n" + UNREAD
    )
    command = [str(TEXTLINT), "--config", str(CONFIGURATION), "--format", "json", str(tmp_path / "page.md")]
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)[0]["messages"]
    assert [(message["line"], message["ruleId"]) for message in told] == [(3, "terminology"), (5, "sentence-length")]
    assert "use “Setpoints” instead" in told[0]["message"]
