"""What the package carries of the page's rig is what its sources make: ``python -m birthsim_live.rig.build`` renews it."""

import json

import numpy as np
import pytest

import birthsim_env
from birthsim_env import registry
from birthsim_env.parts.scenarios import scenarios_for
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import FIELDS
from birthsim_live.rig.build import build
from birthsim_live.rig.folder import PAGE, compact, packed_page
from birthsim_live.rig.greeting import greeting
from birthsim_live.rig.pack import rig_numbers
from tests.build.targets import need_linker

BUILT = PAGE / "rig"
CARRIED = json.loads((BUILT / "pack.json").read_text(encoding="utf-8"))
RENEW = "python -m birthsim_live.rig.build renews it"


@pytest.mark.slow
@pytest.mark.weekly
def test_a_fresh_build_is_equal(tmp_path, monkeypatch):
    """Of what it lists: what is registered since then waits for the next build, and the page says so."""
    need_linker()
    for kind, choices in CARRIED["hello"]["choices"].items():
        if kind in registry.ROOMS:
            known = {one["name"] for one in choices}
            if kind == "scenario":  # the code of every rig has those of rails too, which this one does not list
                known |= {name for name in registry.names(kind) if name not in scenarios_for(Parameters())}
            kept = {one.name: one for one in registry.entries(kind) if one.name in known or not one.listed}
            monkeypatch.setitem(registry._ENTRIES, kind, kept)
    build(tmp_path)
    for name in ("loop.wasm", "learn.wasm", "learn.bin", "learn.json"):
        assert (BUILT / name).read_bytes() == (tmp_path / name).read_bytes(), f"{name}: {RENEW}"
    assert json.loads((tmp_path / "pack.json").read_text()) == CARRIED, RENEW
    built, made = (np.fromfile(folder / "loop.bin", dtype=np.int64) for folder in (BUILT, tmp_path))
    differs = np.flatnonzero(built != made)
    # Other processors design a linear regulator with other rounding errors.
    np.testing.assert_allclose(*(words[differs].view(np.float64) for words in (built, made)), rtol=1e-6, err_msg=RENEW)


def test_it_says_what_the_words_and_the_rig_say():
    packed, rig = packed_page(Parameters()), Parameters()
    assert packed.content["birthsim"] == birthsim_env.__version__, RENEW
    hello = json.loads(compact(greeting(rig, packed.content["hello"]["choices"]["controller"])))
    for kind in ("scenario", "sensors"):
        for one in packed.content["hello"]["choices"][kind]:
            one.pop("missing", None)  # of what was registered since it was built
    assert json.loads(compact(packed.content["hello"])) == hello, RENEW
    assert packed.content["rig"] == json.loads(compact(rig_numbers(rig))), RENEW


def test_it_is_small():
    sizes = {path.name: path.stat().st_size for path in BUILT.iterdir()}
    assert sum(sizes.values()) < 2e6  # of which a policy takes some 45 kB
    assert sum(size for name, size in sizes.items() if name.startswith("learn")) < 0.3e6


def test_the_page_knows_the_columns_of_a_recording():
    """It reads recordings by names and sizes of its own."""
    text = (PAGE / "frame.js").read_text(encoding="utf-8").partition("FIELDS = {")[2].partition("}")[0]
    named = [entry.partition(":") for entry in text.split(",") if entry.strip()]
    assert [(name.strip(), int(size)) for name, _, size in named] == list(FIELDS.items())
