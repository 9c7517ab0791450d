"""Words that code hands to pages and users: whole first sentences, and extras that can be installed as they say."""

import subprocess

import pytest

from birthsim_env.extras import installation
from tests.console import ROOT

SENTENCES = {
    "Backstepping control (Herzig et al. 2015, section IV). More.": "Backstepping control (Herzig et al. 2015, section IV).",
    "As Colgate et al. have it, e.g. for a spring. Then.": "As Colgate et al. have it, e.g. for a spring.",
    "The rig of N. Herzig, see Fig. 4. More.": "The rig of N. Herzig, see Fig. 4.",
    "Pushes of 10 N. Then rest.": "Pushes of 10 N.",
    "Stay at (0.5, 0.1) m (cf. Eq. 3; assumed). More.": "Stay at (0.5, 0.1) m (cf. Eq. 3; assumed).",
    "A trained residual: the network": "A trained residual",
    "Read a folder; raises what it must.": "Read a folder",
    "No stop at all": "No stop at all",
}


@pytest.mark.parametrize("text", SENTENCES)
def test_a_first_sentence_ends_where_it_ends(text, generated):
    assert generated(".sentences").first_sentence(text) == SENTENCES[text]


@pytest.mark.parametrize("package", ["birthsim_env", "baselines", "agents"])
def test_no_first_sentence_of_the_api_ends_within_brackets_or_an_abbreviation(package, generated):
    listed = [line for line in generated(".api").api(package).split("\n") if line.startswith("- {py:obj}")]
    assert len(listed) > 5
    for line in listed:
        assert line.count("(") == line.count(")"), line
        assert not line.endswith((" al.", "e.g.", "i.e.", "Fig.", "cf.")), line


def test_nothing_promises_an_index_that_has_no_birthsim():
    assert installation("agents", "onnx") == "pip install -e '.[agents,onnx]' in a clone"
    told = subprocess.run(
        ["git", "grep", "-nE", r"pip install[^#]*['\" ]birthsim(\[|['\"]|$)", "--", "*.py", "*.md", "*.js", "*.toml"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    ).stdout.splitlines()
    past = ("CHANGELOG.md", "docs/data/installed.md", "lab/studies/installed/study.py", "tests/project/test_words_of_code.py")
    assert [line for line in told if not line.startswith(past)] == []
