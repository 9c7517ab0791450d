"""What the site shows of environments, policies and citations agrees with the code; a page opened from a disk is not dead."""

import re
import tomllib

import pytest
import yaml

import birthsim
from birthsim_env.assembly import DEFAULTS
from birthsim_env.info import FIELDS
from birthsim_env.parts.scenarios import environment_id, scored_scenarios
from birthsim_env.registry import names
from lab.studies.leaderboard.records import every_entry, openness, standings
from tests.console import ROOT

DOCS = ROOT / "docs"
LARGEST = 400_000
"""Bytes of a film: nine of them stand on one page."""


@pytest.fixture(scope="module")
def parts(generated):
    return {name: part() for name, part in generated("").PARTS.items() if not name.startswith("api_")}


@pytest.mark.parametrize("scenario", scored_scenarios())
def test_an_environment_has_a_film_a_page_and_its_task_in_the_overview(scenario, parts, generated):
    page = generated(".environments.scores").page_of(scenario)
    text = (DOCS / "environments" / f"{page}.md").read_text(encoding="utf-8")
    kind, plain = "rail" if page == "rail" else "plane", environment_id(scenario).removeprefix("BirthSIM/")
    for part in (f"environment-{scenario}", f"returns-{scenario}", f"record-{plain}", f"contract-{kind}"):
        assert f"docs-generated/{part}.md" in text
    assert f"]({scenario}.webp)" in text
    assert 50_000 < (DOCS / "environments" / f"{scenario}.webp").stat().st_size < LARGEST
    assert f"[`{environment_id(scenario)}`]({page}.md)" in parts["environments.md"]
    env = birthsim.make(environment_id(scenario))
    for space in (env.action_space, env.observation_space):
        assert f"`{space}`" in parts[f"environment-{scenario}.md"]
    shown = [row.split(" | ")[0].strip("| ") for row in parts[f"contract-{kind}.md"].split("## Observation")[1].splitlines()]
    last = env.observation_space.shape[0] - 1
    assert f"{last + 1 - env.action_space.shape[0]} to {last}" in shown


def test_a_contract_names_every_argument_default_and_key_of_info(parts):
    for linkage in ("plane", "rail"):
        text = parts[f"contract-{linkage}.md"]
        assert [name for name, value in DEFAULTS.items() if f"`{name}={value!r}`" not in text] == []
        assert [name for name in FIELDS if f"| `{name}` |" not in text] == []
        titles = ["Action", "Observation", "Reward", "Start and end of an episode", "Arguments", "Info"]
        assert re.findall(r"^## (.*)$", text, re.MULTILINE) == titles


def test_returns_of_an_environment_are_those_of_the_scores(parts):
    table = (DOCS / "data" / "scores.md").read_text(encoding="utf-8")
    for scenario in scored_scenarios():
        plain = environment_id(scenario).removeprefix("BirthSIM/").rpartition("-v")[0]
        for sensors in ("ideal", "lab"):
            (row,) = re.findall(rf"^\| {plain} \| {sensors} \| randomised \| .*$", table, re.MULTILINE)
            *_, paper, best, policy = (cell.strip() for cell in row.strip("| ").split("|"))
            own = re.search(rf"^\| `{sensors}` \| (.*) \|$", parts[f"returns-{scenario}.md"], re.MULTILINE)[1].split(" | ")
            assert own[:2] == [paper, re.sub(r", (.*)", r", `\1`", best)]
            if policy != "-":
                assert own[2] == re.sub(r", (\S+) .*", r", `\1`", policy)
            else:
                trained = sensors == "ideal" and f"{scenario}_apg" in names("policy")
                assert own[2] == ("not measured" if trained else "none")


def test_what_is_to_beat_has_the_records_of_the_leaderboard(parts):
    known = every_entry()
    for environment in ("Circle-v2", "Vacuum-v1"):
        (row,) = re.findall(rf"^\| \[{environment}\].*$", parts["beat.md"], re.MULTILINE)
        for cell, kind in zip(row.split("|")[2:], ("ideal", "lab", "honest", "honest-no-force"), strict=False):
            own = standings(f"{environment.partition('-')[0].lower()}-{kind}", known)
            assert f"**{openness(own)}**" in cell
            assert not own or f"{own[0].score:.0f}, {own[0].name}" in cell
            learned = [one for one in own if one.is_learned]
            assert learned or not own or "learned: none" in cell
            assert not learned or f"{learned[0].score:.0f}, {learned[0].name}" in cell


def test_every_policy_has_its_training_and_its_results(parts):
    trained, reached = parts["policies.md"].split("## What they reach")
    for name in birthsim.policies():
        settings = birthsim.load_policy(name).settings
        (row,) = re.findall(rf"^\| `{name}` \| .*$", trained, re.MULTILINE)
        assert ("valves alone" if settings.law == "none" else f"`{settings.law}`") in row
        assert (settings.force_sensor, settings.informed) == ("force" in row.split("|")[-2], "estimates" in row)
        assert len(re.findall(rf"^\| `{name}` \| ", reached, re.MULTILINE)) == 1
    assert re.search(r"^\| `vacuum_apg` .*of no use with `lab` sensors", reached, re.MULTILINE)
    assert not re.search(r"^\| `circle_lab` .*of no use", reached, re.MULTILINE)


def test_bibtex_has_the_paper_and_the_software_as_the_citation_file_says(parts):
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    text = parts["bibtex.md"]
    assert f"doi = {{{cited['preferred-citation']['doi']}}}" in text
    assert [person for one in cited["preferred-citation"]["authors"] if (person := one["family-names"]) not in text] == []
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"version = {{{cited['version']}}}" in text
    assert cited["version"] == project.get("version", cited["version"])
    assert re.findall(r"^@(\w+)\{", text, re.MULTILINE) == ["inproceedings", "software"]
    assert text.count("{") == text.count("}")


def test_a_page_opened_from_a_disk_shows_a_film_and_how_to_start_the_rig(chromium, generated, tmp_path):
    landing = generated(".landing")
    script = (DOCS / "_static" / "disk.js").read_text(encoding="utf-8")
    frames = "".join(
        f'<iframe class="rig" title="{asked}" data-film="../_static/{film}"></iframe>' for asked, film in landing.FILMS.items()
    )
    page = tmp_path / "a site" / "explanation" / "steps.html"
    page.parent.mkdir(parents=True)
    page.write_text(
        f'<!doctype html><html data-content_root="../">{frames}<iframe class="rig" title="x"></iframe><script>{script}</script>'
    )
    assert [film for film in landing.FILMS.values() if not (DOCS / film).exists()] == []
    with chromium.new_context() as context:
        shown = context.new_page()
        shown.goto(page.as_uri())
        assert shown.locator("iframe").count() == 0
        assert shown.locator("figure img").count() == len(landing.FILMS)
        assert shown.locator("figure code").first.inner_text() == f'python -m http.server -d "{tmp_path}/a site/"'
        assert shown.locator("figure a").first.get_attribute("href") == "http://127.0.0.1:8000/explanation/steps.html"


def test_a_page_that_is_served_keeps_its_rig(chromium):
    script = (DOCS / "_static" / "disk.js").read_text(encoding="utf-8")
    with chromium.new_context() as context:
        shown = context.new_page()
        frame = f'<iframe class="rig"></iframe><script>{script}</script>'
        shown.route("**/*", lambda route: route.fulfill(body=frame, content_type="text/html"))
        shown.goto("http://127.0.0.1:9/index.html")
        assert shown.locator("iframe.rig").count() == 1
