"""Tubes that others measured: a model is found again in logs that it wrote, broken lines and cycles included."""

import numpy as np
import pytest

from lab.studies.validation import tubes
from lab.studies.validation.tubes import AIR, BAR, NAMES, Case, foretold

TRUE = np.array([5e-3, 4e-9, 2e-8, 3e-3, 6e-3, 5e-3, 4e-3, 0.018, 0.019, 0.021])


def written(folder, length, supply, way):
    """A log of eight cycles, each with a row every 35 ms that begins a little later."""
    fills, lines = tubes.WAYS[way], ["=~=~= PuTTY log =~=~=", "40.0"]
    source = supply * BAR + AIR.atmospheric_pressure
    for _ in range(8):
        times = np.sort(np.concatenate([[0.0], np.arange(0.012, 1.5, 0.035)]))
        case = Case(length, supply, fills, source, AIR.atmospheric_pressure if fills else source, times, np.empty((2, 0)))
        rows = zip(1e3 * times, *foretold(TRUE, case), strict=True)
        lines += [f"{time:.0f}, {near:.6f}, {far:.6f}, 900, 305" for time, near, far in rows]
    (folder / f"tube_l{length}_p{supply}_{way}.csv").write_text("\n".join([*lines, "30766, 0.019"]), encoding="latin-1")


def test_a_model_is_found_again_in_what_it_wrote(tmp_path, monkeypatch):
    monkeypatch.setattr(tubes, "LENGTHS", (1, 3, 6))
    folder = tmp_path / tubes.FOLDER
    folder.mkdir()
    for length in tubes.LENGTHS:
        for supply in tubes.SUPPLIES:
            for way in tubes.WAYS:
                written(folder, length, supply, way)
    found = tubes.measure(str(tmp_path), {})
    assert found["all"] < 0.03
    assert found["foretold"] < 0.03
    assert [found["parameters"][name] for name in NAMES[:3]] == pytest.approx(TRUE[:3], rel=0.1)


def test_both_ends_of_a_tube_come_to_the_pressure_behind_the_valve():
    case = Case(2, 5, True, 6.013e5, 1.013e5, np.array([0.0, 0.02, 3.0]), np.empty((2, 0)))
    near, far = foretold(TRUE, case)
    assert near[0] == far[0] == 0.0
    assert near[1] > far[1] > 0.0
    assert near[2] == pytest.approx(5.0, abs=0.01)
    assert far[2] == pytest.approx(5.0, abs=0.01)
