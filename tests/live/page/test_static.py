"""The page as a folder of files: any server shows it below any address, and it records and replays by itself."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from agents.policy.shipped import SHIPPED
from birthsim_live.logs.recording import COLUMNS, load_recording
from tests.console import run as command
from tests.live.browser import CALM, Window, served
from tests.live.rig.worker import run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("static") / "deeper" / "page"
    own = shutil.copytree(SHIPPED / "circle" / "seed_0", tmp_path_factory.mktemp("runs") / "own")
    done = command("live", "--static", folder, "--policy", own)
    assert f"written to {folder}" in done.stdout, done.stderr
    return folder


@pytest.fixture(scope="module")
def server(built):
    with served(built.parent) as url:
        yield SimpleNamespace(url=f"{url}{built.name}/")


@pytest.mark.parametrize("compare", ["nothing", "backstepping"])
def test_a_recorded_episode_has_the_bits_of_the_loop(window, page, tmp_path, compare):
    tab = window.page
    window.choose(compare=compare, scenario="circle")
    tab.locator("input[name=scenario_force]").check()
    window.wait("birthsim.settings.scenario_force")
    window.live(0.3)
    tab.locator("#record").click()
    window.wait("birthsim.state.recording !== null")
    tab.locator("#pause").click()
    window.wait("birthsim.state.paused")
    tab.locator("#reset").click()
    window.wait("birthsim.frame.time === 0")  # paused, it stays there
    tab.locator("#pause").click()
    window.wait("birthsim.frame.time > 1.5")
    tab.locator("#record").click()
    window.wait("birthsim.state.recording === null && birthsim.state.last_recording !== null")
    with tab.expect_download() as download:
        tab.locator("#download").click()
    download.value.save_as(tmp_path / "circle.rec")
    window.play(tmp_path / "circle.rec")
    window.wait("birthsim.state.file === 'circle.rec' && birthsim.frame.time > 0")
    window.back()
    recording = load_recording(tmp_path / "circle.rec")
    begun = int(np.argmin(recording.rows[:, 0]))
    rows = np.hstack([recording.rows, recording.second])[begun:]
    assert len(rows) > 300
    instants = np.round(rows[:, 0] / 0.001).astype(int)
    settings = {"scenario": "circle", "scenario_force": True, "controller": CALM.partition("=")[2], "compare": compare}
    told = run(page, [("set", settings), ("reset", None), ("advance", int(instants[-1]))])[0][-1]
    expected = np.hstack([told.row, told.second_row]) if compare != "nothing" else told.row
    moved = instants > 0
    found, wanted = rows[moved, : expected.shape[1]], expected[instants[moved] - 1]
    assert np.array_equal(found, wanted, equal_nan=True)
    assert np.isfinite(rows[moved, COLUMNS]).all() == (compare != "nothing")


def test_a_policy_of_ones_own_opens_the_page(chromium, server):
    with Window(chromium, server.url) as window:
        window.wait("birthsim.settings.controller.endsWith('own') && birthsim.frame.lost === null")
        window.wait("document.querySelector('select[name=controller]').selectedOptions[0].text.includes('own')")
        window.live(0.2)


def test_a_file_that_is_missing_is_named(chromium, built, tmp_path):
    folder = shutil.copytree(built, tmp_path / "page")
    (folder / "rig" / "loop.wasm").unlink()
    with served(folder) as url:
        page = chromium.new_page()
        page.goto(url)
        page.locator("#offline", has_text="loop.wasm is missing (404)").wait_for()
        page.close()


def test_from_a_disk_it_explains_itself(chromium, built):
    page = chromium.new_page()
    page.goto((built / "index.html").as_uri())
    page.locator("#offline", has_text="run birthsim live, or any server of files").wait_for()
    page.close()


def test_in_a_long_page_only_a_rig_in_sight_runs(chromium, built):
    frame = f'<iframe src="{built.name}/index.html?embed=1" width="700" height="430"></iframe>'
    (built.parent / "long.html").write_text(f'<!doctype html>{frame}<div style="height: 5000px"></div>')
    page = chromium.new_page()
    with served(built.parent) as url:
        page.goto(f"{url}long.html")
        (inner,) = page.frames[1:]

        def becomes(paused):
            while inner.evaluate("() => window.birthsim?.state?.paused") is not paused:
                page.wait_for_timeout(30)

        becomes(False)
        page.evaluate("() => scrollTo(0, 4000)")
        becomes(True)
        page.evaluate("() => scrollTo(0, 0)")
        becomes(False)
    page.close()
