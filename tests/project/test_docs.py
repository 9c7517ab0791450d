"""The documentation site: pages have their places, generated parts know everything, tables sort, it builds."""

import csv
import fnmatch
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import birthsim
from agents.training.configuration import configuration_names
from baselines.bench import evaluation
from baselines.bench.metrics import UNITS
from baselines.named import GUARDING, known_options, resolved, uncontrolled_names
from birthsim.main import COMMANDS
from birthsim_env import Parameters
from birthsim_env.ids import environment_ids
from birthsim_env.registry import names
from lab.studies.comparison import tables as comparison_tables
from lab.studies.honest import worst
from lab.studies.leaderboard import tables as leaderboard_tables
from lab.studies.scores import tables as score_tables
from tests.console import ROOT
from tests.live import axe, browser

DOCS = ROOT / "docs"
TABLES = {path.name: path.read_text(encoding="utf-8") for path in (DOCS / "data").glob("*.md")}


def with_tables(page):
    text = page.read_text(encoding="utf-8")
    return re.sub(r"^```\{include\} (?:\.\./)?data/(.*)\n```$", lambda block: TABLES[block[1]], text, flags=re.MULTILINE)


PAGES = {
    page.relative_to(DOCS).with_suffix("").as_posix(): with_tables(page)
    for page in DOCS.rglob("*.md")
    if page.parent.name != "data"
}

NUMBER = re.compile(r"\b\d+\.\d+\b")

TABLE = """<!doctype html><article><table class="docutils"><thead><tr><th>law</th><th>error, mm</th></tr></thead>
<tbody>{}</tbody></table></article><script>{}</script>"""


def listed(page):
    folder = (DOCS / page).parent
    for block in re.findall(r"^```\{toctree\}\n(.*?)^```", PAGES[page], re.MULTILINE | re.DOTALL):
        for line in filter(None, block.splitlines()):
            if not line.startswith(":"):
                named = re.sub(r".*<(.*)>", r"\1", line)
                yield (folder / named).resolve().relative_to(DOCS).as_posix()


def test_the_toctrees_name_every_page_once():
    found = sorted(one for page in PAGES for one in listed(page))
    assert found == sorted(set(PAGES) - {"index"})


@pytest.mark.parametrize("page", [page for page in PAGES if "{toctree}" in PAGES[page]])
def test_what_a_toctree_names_is_linked_for_readers_without_one(page):
    folder = (DOCS / page).parent
    links = re.findall(r"\]\(([^)#:]+\.md)\)", PAGES[page])
    linked = {(folder / link).resolve().relative_to(DOCS).with_suffix("").as_posix() for link in links}
    assert set(listed(page)) - linked == set()


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("explanation/") and not page.endswith("index")])
def test_every_number_of_an_explanation_stands_in_a_page_that_it_links(page):
    # What sets the rig of a page, {rig}`friction=1.5`, states nothing.
    prose = re.sub(r"^```.*?^```|\{rig\}`[^`]*`", "", PAGES[page], flags=re.MULTILINE | re.DOTALL)
    links = {(DOCS / page).parent / link for link in re.findall(r"\]\(([^)#:]+\.md)", prose)}
    known = {number for link in links for number in NUMBER.findall(with_tables(link))}
    assert set(NUMBER.findall(prose)) - known == set()


@pytest.fixture(scope="module")
def parts(generated):
    return {name: part() for name, part in generated("").PARTS.items()}


def test_generated_parts_know_everything(parts):
    commands = [f"birthsim {name}" for name in COMMANDS if name not in ("study", "export")] + ["--episodes 1..1000000"]
    ids = [name for name in environment_ids() if "Residual" not in name]
    rig = Parameters().to_dict()
    electronics, rig = rig.pop("electronics"), [name for section in rig.values() for name in section]
    for part, known in (
        *(
            ("commands*.md", commands),
            ("environments.md", ids),
            ("metrics.md", UNITS),
            ("rig.md", rig),
            ("electronics.md", electronics),
        ),
        *(("sensors.md", names("sensors")), ("hands.md", names("hand")), ("frictions.md", names("friction"))),
        *(("readers.md", names("reader")), ("configurations.md", [*configuration_names(), "rig_reader", "vacuum_apg"])),
    ):
        text = "".join(parts[one] for one in fnmatch.filter(parts, part))
        assert [name for name in known if f"`{name}`" not in text] == [], part


@pytest.mark.parametrize("name", sorted({resolved(name)[0] for name in names("controller")}))
def test_each_option_and_gain_of_a_controller_has_its_meaning_and_what_is_allowed(generated, name):
    of = generated(".controllers")
    page = "".join(of.options(family) for family in of.FAMILIES)
    section = page.partition(f"### `{name}`\n")[2].partition("###")[0] if f"### `{name}`" in page else ""
    on_pages = [option for option in known_options(name) or () if option not in GUARDING]
    if name in ("residual", *uncontrolled_names()):
        assert not section
        return
    rows = {row.split(" | ")[0].strip("| `"): row.strip("| ").split(" | ") for row in section.splitlines() if row[:3] == "| `"}
    assert list(rows) == on_pages
    for option, (_, unit, meaning, *others) in rows.items():
        assert meaning.strip(), f"{option} has no meaning: docs/_generate/controllers.py"
        assert all(cell.strip() for cell in others), option
        assert unit.strip() or not re.search(r"\d", others[-1]) or "`" in others[-1], option


def test_pages_of_the_code_spell_out_arguments_and_defaults(parts):
    front = "".join(text for name, text in parts.items() if name.startswith("api_birthsim_") and name != "api_birthsim_env.md")
    pages = "".join(parts[f"api_{package}.md"] for package in ("birthsim_env", "baselines", "agents"))
    assert [name for name in birthsim.__all__ if f"## `{name}`" not in front] == []
    assert "HAS_DEFAULT_FACTORY" not in front + pages
    assert "**arguments" not in pages  # make takes those of any environment
    assert (front + pages).count("sensors: str = 'ideal', randomize: Randomize = False") == 3


def test_every_part_has_its_page(parts):
    included = {Path(file).name for page in PAGES.values() for file in re.findall(r"\{include\} (\S+)", page)}
    assert included == set(parts)


def test_a_table_sorts_by_numbers_and_words(page_of):
    cells = {"b": "12 [9, 15]", "c": "lost", "a": "0.5; 3", "d": ""}
    rows = "".join(f"<tr><td>{law}</td><td>{error}</td></tr>" for law, error in cells.items())
    page = page_of(TABLE.format(rows, (DOCS / "_static" / "tables.js").read_text(encoding="utf-8")))

    def order():
        return "".join(page.locator("tbody td:first-child").all_text_contents())

    page.get_by_role("button", name="error, mm").click()
    assert order() == "abcd"
    page.get_by_role("button", name="error, mm").click()
    assert order() == "dcba"
    assert page.get_by_role("columnheader", name="error, mm").get_attribute("aria-sort") == "descending"
    page.get_by_role("button", name="law").click()
    assert order() == "abcd"


DATA = """<!doctype html><article><p>All: <a href="_downloads/1/figures.csv">figures.csv</a></p></article>
<script type="text/csv" title="figures.csv">where,rig,law,unit,error
circle,nominal,b,mm,12
circle,nominal,a,mm,lost
circle,"drawn, nominal",a,mm,3
probe,nominal,a,mm,7
</script><script>{}{}</script>"""


def test_a_data_file_is_chosen_from_and_sorted(page_of):
    page = page_of(DATA.format(*((DOCS / "_static" / name).read_text(encoding="utf-8") for name in ("tables.js", "data.js"))))

    def seen():
        return [row.locator("td:visible").all_text_contents() for row in page.locator("tbody tr:visible").all()]

    assert seen() == [["b", "12"], ["a", "lost"]], "the first of each word, and every law; the unit is the same everywhere"
    page.get_by_label("rig").select_option("drawn, nominal")
    assert seen() == [["a", "3"]]
    page.get_by_label("rig").select_option("all")
    page.get_by_label("where").select_option("all")
    page.get_by_role("button", name="error").click()
    assert seen() == [
        ["circle", "drawn, nominal", "a", "3"],
        ["probe", "nominal", "a", "7"],
        ["circle", "nominal", "b", "12"],
        ["circle", "nominal", "a", "lost"],
    ]
    assert "4 of 4 rows" in page.locator("article").inner_text()


def test_the_first_word_of_the_glossary_in_a_page_explains_itself(page_of, generated):
    script = generated(".words").script() + (DOCS / "_static" / "glossary.js").read_text(encoding="utf-8")
    text = "<article><p><a>Hunting</a> is hunting in a control period; hunting</p><h2>lane</h2></article>"
    page = page_of(f"<!doctype html>{text}<script>{script}</script>")
    marked = page.locator("abbr")
    assert marked.all_text_contents() == ["hunting", "control period"]
    assert marked.nth(1).get_attribute("title") == "1 ms: how often the controller runs."
    assert page.locator("p").inner_text() == "Hunting is hunting in a control period; hunting"


@pytest.fixture
def page_of(chromium):
    with chromium.new_context() as context:

        def shown(content):
            page = context.new_page()
            page.set_content(content)
            return page

        yield shown


def test_data_files_are_those_that_pages_link_and_have_the_columns_that_commands_write():
    texts = {path.name: path.read_text(encoding="utf-8") for path in (DOCS / "data").glob("*.csv")}
    columns = {name: tuple(next(csv.reader(text.splitlines()))) for name, text in texts.items()}
    text = "".join([*PAGES.values(), *TABLES.values()])
    assert set(columns) <= {Path(link).name for link in re.findall(r"\]\((?:\.\./)?(data/[^)]+)\)", text)}
    compared = {f"{name}.csv": comparison_tables.DATA for name in ("comparison", "bound")}
    others = {
        "scores.csv": score_tables.DATA,
        "learned.csv": ("policy", *evaluation.DATA),
        "leaderboard.csv": leaderboard_tables.DATA,
        "worst-causes.csv": worst.DATA,
    }
    assert columns == compared | others


NOTEBOOKS = [page for page, text in PAGES.items() if "{code-cell}" in text]
BRIEF = ("tutorials/first_episode",)
"""Notebooks that a commit runs; the others weekly."""

LARGE = ("laboratory/comparison", "environments/index", "environments/circle", "reference/commands/measure")
"""Pages of which each takes axe half a minute."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the site, built as for a repository on GitHub, with some notebooks run."""
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_nb")
    if not axe.AXE.exists() and os.environ.get("CI") != "true":
        pytest.skip("the site's equations need what make npm installs")

    @cache
    def folder_with(run):
        folder, left = tmp_path_factory.mktemp("site"), " ".join(f"{page}.md" for page in NOTEBOOKS if page not in run)
        command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", str(DOCS), str(folder)]
        if left:  # cells that no kernel has said the language of
            command += ["-D", "suppress_warnings=misc.highlighting_failure"]
        given = {**os.environ, "BIRTHSIM_REPOSITORY": "someone/birthsim", "BIRTHSIM_UNRUN_NOTEBOOKS": left}
        done = subprocess.run(command, env=given, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-4000:]
        return folder

    return folder_with


@pytest.fixture(scope="module")
def site(built):
    return built(BRIEF)


@pytest.mark.slow
@pytest.mark.parametrize("run", [BRIEF, pytest.param(tuple(NOTEBOOKS), marks=pytest.mark.weekly)], ids=["brief", "all"])
def test_the_site_builds_without_a_warning_and_its_notebooks_run(built, run):
    site = built(run)
    assert len(NOTEBOOKS) >= 5
    assert [page for page in run if 'class="cell_output' not in (site / f"{page}.html").read_text("utf-8")] == []
    tutorials = [Path(page).name for page in NOTEBOOKS if page.startswith("tutorials/")]
    assert sorted(tutorials) == sorted(file.stem for file in (site / "notebooks").iterdir())
    for name in tutorials:
        links = re.search(r'<p class="notebook">.*?</p>', (site / "tutorials" / f"{name}.html").read_text("utf-8"), re.DOTALL)
        assert re.findall(r">(\w[^<]+)<", links[0]) == ["Download this notebook", "Open in Colab", "Open in Binder"]
    assert (site / "rig" / "rig" / "loop.wasm").exists()
    landing = (site / "index.html").read_text("utf-8")
    assert 'src="rig/index.html' in landing
    # Of a site that has a repository a shared link shows a picture, and the install line leads there.
    assert '"https://someone.github.io/birthsim/rig/card.png"' in landing
    assert landing.count("https://github.com/someone/birthsim") >= 2
    assert (site / "rig" / "card.png").exists()
    steps = (site / "explanation" / "steps.html").read_text("utf-8")
    assert steps.count('src="../rig/index.html?embed=1&amp;') == 6
    assert "GLOSSARY" in (site / "_static" / "words.js").read_text("utf-8")


@pytest.mark.slow
@axe.NEEDED
@pytest.mark.parametrize(
    ("theme", "pages"),
    [
        ("light", ("index", "tutorials/first_episode")),
        pytest.param("light", LARGE, marks=pytest.mark.weekly),
        pytest.param("dark", ("index", "tutorials/first_episode", *LARGE), marks=pytest.mark.weekly),
    ],
)
def test_axe_finds_nothing_on_the_site(site, page_of, theme, pages):
    page = page_of("")
    page.emulate_media(color_scheme=theme)
    with browser.served(site) as url:
        for name in pages:
            page.goto(f"{url}{name}.html")
            assert axe.violations(page, "iframe") == [], name


@pytest.mark.slow
@axe.NEEDED
def test_equations_are_drawn_from_a_file_of_the_site(site, page_of):
    page, drawn = page_of(""), "mjx-container:not(:has([data-mml-node=merror]))"
    with browser.served(site) as url:
        for name in ("explanation/equations", "explanation/hand", "live"):
            page.goto(f"{url}{name}.html")
            written = page.locator(".math").count()
            assert written > 0, name
            page.wait_for_function(f"document.querySelectorAll('mjx-container').length == {written}")
            assert page.locator(drawn).count() == written, name


FAILING = """---
jupytext:
  text_representation:
    extension: .md
    format_name: myst
kernelspec:
  name: python3
---
# A tutorial

```{code-cell}
first = 1
```

```{code-cell}
first / 0
```
"""


@pytest.mark.slow
def test_a_cell_that_fails_is_named_and_no_one_elses_tracker(tmp_path):
    """With the settings of the site's own notebooks, none of which has a limit of time."""
    settings = [line for line in (DOCS / "conf.py").read_text(encoding="utf-8").splitlines() if line.startswith("nb_")]
    assert "nb_execution_timeout = -1" in settings
    (tmp_path / "conf.py").write_text("\n".join(["import os", 'extensions = ["myst_nb"]', *settings]))
    (tmp_path / "index.md").write_text(FAILING)
    line = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", tmp_path, tmp_path / "out"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    for words in ("index.md: WARNING: Executing notebook failed", "first / 0", "ZeroDivisionError"):
        assert words in done.stderr
    assert "sphinx-doc/sphinx/issues" not in done.stderr
