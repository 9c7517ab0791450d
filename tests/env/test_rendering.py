"""The pictures: where things are drawn, in which colour, for which rigs, with and without a window."""

import dataclasses
import math
import os
import subprocess
import sys
import time

import numpy as np
import pygame
import pytest

from birthsim_env.drawing.rendering import Renderer, Scene
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles.linkage_by_points import pose_from_lengths

RIG = Parameters()
RENDERER = Renderer(RIG)
NAN, INF = math.nan, math.inf
NOWHERE = (NAN, NAN)
# Targets are left out unless a test looks for them: they would lie over the end effector.
SCENE = Scene(
    time=1.0,
    piston=(0.02, 0.05),
    target=NOWHERE,
    compliant_target=NOWHERE,
    user_force=(0.0, 0.0),
    pressures=(2e5, 3e5, 4e5, 5e5),
    stiffness=(2000.0, 2000.0),
    path=np.zeros((0, 2)),
    title="test",
)


def changed(**values):
    return dataclasses.replace(SCENE, **values)


def linkage(piston, rig=RIG):
    """End effector, joint and pivot of cylinder 1, as complex numbers, of the linkage made of points."""
    pose = pose_from_lengths(piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2, rig.geometry)
    return tuple(complex(*point) for point in (pose.end_effector, pose.attachment, pose.pivot))


def near(picture, colour, tolerance=8):
    """Mask (height, width) of the pixels of one colour."""
    return np.all(np.abs(picture.astype(int) - colour) <= tolerance, axis=2)


def pixel(picture, point):
    column, row = RENDERER.to_pixel((point.real, point.imag))
    return picture[int(row), int(column)].astype(int)


def luminance(colour):
    return float(np.dot(colour, (0.299, 0.587, 0.114)))


@pytest.mark.parametrize("size", [(640, 480), (320, 240), (1280, 960), (1000, 250), (321, 777)])
def test_frame_has_the_asked_shape_and_shows_something(size):
    picture = Renderer(RIG, *size).frame(SCENE)
    assert picture.shape == (size[1], size[0], 3)
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.astype(int) @ (1 << 16, 1 << 8, 1))) > 50, "colours"


def test_the_transform_is_to_scale_with_y_up():
    (x0, y0), (x1, y1), (x2, y2) = (RENDERER.to_pixel(p) for p in ((0, 0), (0.1, 0), (0, 0.1)))
    assert x1 - x0 == pytest.approx(y0 - y2)
    assert x1 - x0 > 40, "the mechanism must fill the view"
    assert (y1, x2) == (pytest.approx(y0), pytest.approx(x0))


@pytest.mark.parametrize("piston", [(0.0, 0.0), (0.06, 0.12), (-0.07, -0.1), (-0.09, 0.18)])
def test_the_end_effector_is_drawn_where_the_geometry_says(piston):
    picture = RENDERER.frame(changed(piston=piston))
    point, _, _ = linkage(piston)
    column, row = RENDERER.to_pixel((point.real, point.imag))
    around = near(picture, (14, 14, 18))[int(row) - 12 : int(row) + 13, int(column) - 12 : int(column) + 13]
    rows, columns = np.nonzero(around)
    assert len(rows) >= 9
    assert np.mean(columns) + int(column) - 12 + 0.5 == pytest.approx(column, abs=0.8)
    assert np.mean(rows) + int(row) - 12 + 0.5 == pytest.approx(row, abs=0.8)


def test_target_and_compliant_target_are_drawn_at_their_places():
    # The magnifier's frame surrounds the compliant target, so that one stands alone.
    picture = RENDERER.frame(changed(target=(0.45, -0.12), compliant_target=(0.55, -0.15)))
    assert near(picture, (255, 150, 0))[tuple(int(v) for v in RENDERER.to_pixel((0.55, -0.15))[::-1])]
    column, row = RENDERER.to_pixel((0.45, -0.12))
    ring = near(picture, (0, 112, 128), 40)[int(row) - 12 : int(row) + 13, int(column) - 12 : int(column) + 13]
    assert ring.any()
    assert not ring[12, 12], "a ring is hollow"


def test_a_millimetre_of_error_is_seen_in_the_magnifier():
    point, _, _ = linkage(SCENE.piston)
    places = []
    for error in (0.0, 0.001):
        target = (point.real - error, point.imag)
        picture = RENDERER.frame(changed(target=target, compliant_target=target))
        side = near(picture, (14, 14, 18))[60:220, 475:632]
        places.append(np.mean(np.nonzero(side)[1]))
    assert places[1] - places[0] == pytest.approx(157 / 20, abs=1.0)


@pytest.mark.parametrize("chamber", range(4))
def test_pressure_darkens_its_own_chamber_and_no_other(chamber):
    tip, joint, pivot = linkage((0.0, 0.0))
    along1, along2 = (joint - pivot) / abs(joint - pivot), tip / abs(tip)
    # A quarter of the stroke to either side of the piston, off the axis where the rod runs.
    g, half1, half2 = RIG.geometry, RIG.cylinder1.stroke / 2, RIG.cylinder2.stroke / 2
    front1, front2 = g.k1 - half1 - 0.065, g.k2 - half2 - 0.07
    points = [
        pivot + along1 * (front1 - 1.5 * half1 + 1j * 0.013),
        pivot + along1 * (front1 - 0.5 * half1 + 1j * 0.013),
        along2 * (front2 - 1.5 * half2 + 1j * 0.013),
        along2 * (front2 - 0.5 * half2 + 1j * 0.013),
    ]
    shades = []
    for high in (False, True):
        pressures = [1.5e5] * 4
        pressures[chamber] = 6.5e5 if high else 1.5e5
        picture = RENDERER.frame(changed(piston=(0.0, 0.0), pressures=tuple(pressures)))
        shades.append([luminance(pixel(picture, point)) for point in points])
    change = np.subtract(*shades)
    assert change[chamber] > 80
    assert np.abs(np.delete(change, chamber)).max() < 2


def test_the_piston_moves_in_the_barrel_by_the_stroke():
    places = []
    for y2 in (-0.1, 0.1):
        picture = RENDERER.frame(changed(piston=(-0.0001, y2), pressures=(1.1e5,) * 4))
        tip, _, _ = linkage((-0.0001, y2))
        along = tip / abs(tip)
        # Along the bore beside the rod, the dark piston is what differs from the light chambers.
        steps = np.arange(-0.14, 0.22, 0.001)
        dark = [s for s in steps if luminance(pixel(picture, along * (s + 0.013j))) < 90]
        places.append(np.median(dark))
    assert places[1] - places[0] == pytest.approx(0.2, abs=0.006)


OTHER_RIGS = [
    {"cylinder1.stroke": 0.12, "cylinder2.stroke": 0.6, "geometry.k2": 0.62},
    {"cylinder1.stroke": 0.16, "cylinder2.stroke": 0.1, "geometry.k2": 0.4, "geometry.gamma3": 2.2},
    {"geometry.gamma3": -1.0, "geometry.d6": 0.3},
    {"cylinder2.piston_diameter": 0.1, "cylinder2.rod_diameter": 0.05, "chambers.dead_volume": 1e-4},
]


@pytest.mark.parametrize("changes", OTHER_RIGS)
@pytest.mark.parametrize("size", [(640, 480), (320, 240)])
def test_other_rigs_stay_in_the_picture_and_fill_it(changes, size):
    rig = RIG.replace(changes)
    renderer = Renderer(rig, *size)
    half1, half2 = rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2
    places = []
    for piston in ((a, b) for a in (-half1, half1) for b in (-half2, half2)):
        tip, joint, pivot = linkage(piston, rig)
        places += [renderer.to_pixel((z.real, z.imag)) for z in (tip, joint, pivot, 0j)]
        picture = renderer.frame(changed(piston=piston, pressures=(1.1e5,) * 4, title=""))
        column, row = renderer.to_pixel((tip.real, tip.imag))
        assert near(picture, (14, 14, 18))[int(row), int(column)]
        # The view's outermost pixels stay paper: nothing is cut off.
        assert near(picture[:, 0:2], (250, 251, 252), 12)[-size[1] // 2 :].all()
    low, high = np.min(places, axis=0), np.max(places, axis=0)
    assert low.min() >= 0
    assert high[0] <= 0.74 * size[0]
    assert high[1] <= size[1]
    assert max((high[0] - low[0]) / size[0], (high[1] - low[1]) / size[1]) > 0.4


def arrow_pixels(force, piston=(0.0, 0.0)):
    picture = RENDERER.frame(changed(user_force=force, piston=piston, path=np.zeros((0, 2))))
    mask = near(picture, (196, 16, 72), 4)
    mask[:, 468:] = False  # the legend's own arrow
    return mask


def test_the_arrow_points_along_the_force_and_grows_with_it_up_to_a_limit():
    assert not arrow_pixels((0.0, 0.0)).any()
    none_to_strong = [np.count_nonzero(arrow_pixels((0.0, fy))) for fy in (10.0, 60.0, 400.0, 1e9)]
    assert none_to_strong[0] < none_to_strong[1] < none_to_strong[2]
    assert 0.7 * none_to_strong[2] < none_to_strong[3] < 1.5 * none_to_strong[2]
    row = Renderer(RIG).to_pixel((0.0, linkage((0.0, 0.0))[0].imag))[1]
    for fx, fy, axis, sign in ((0, 60, 0, -1), (0, -60, 0, 1), (60, 0, 1, 1), (-60, 0, 1, -1)):
        counts = np.count_nonzero(arrow_pixels((float(fx), float(fy))), axis=1 - axis)
        # The longest run is the arrow, the others are the letters of its label. An arrow is widest near its tip.
        filled = np.flatnonzero(counts)
        run = max(np.split(filled, np.flatnonzero(np.diff(filled) > 1) + 1), key=len)
        assert sign * (run[np.argmax(counts[run])] - run.mean()) > 5
        if axis == 0:
            assert sign * (run.mean() - row) > 0, "a force across the cylinder is drawn as a pull"


STRANGE = {
    "piston": [(NAN, 0.0), (0.0, NAN), (5.0, 0.0), (0.0, 1e30), (0.0, 0.9)],
    "user_force": [(NAN, 1.0), (INF, -INF), (1e300, 1e300)], "target": [(INF, 0.0)], "compliant_target": [(1e300, -1e300)],
    "pressures": [(NAN, -1e9, 1e12, INF)], "stiffness": [(NAN, INF)], "time": [NAN], "title": ["a\0b\nc " * 60, ""],
    "path": [np.array([[0.4, 0.0], [NAN, 0.1], [0.5, 0.0], [0.6, 0.1], [1e300, 0.0]])],
}  # fmt: skip


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in STRANGE.items() for value in values])
def test_nothing_strange_raises_or_is_drawn_far_outside(name, value, monkeypatch):
    """SDL takes seconds over coordinates far outside."""
    places = []

    def noted(draw):
        return lambda surface, colour, *shape: (places.extend(map(np.ravel, shape)), draw(surface, colour, *shape))[1]

    for shape in ("polygon", "lines", "circle"):
        monkeypatch.setattr(pygame.draw, shape, noted(getattr(pygame.draw, shape)))
    assert Renderer(RIG, 320, 240).frame(changed(**{"user_force": (30.0, 10.0), name: value})).any()
    assert 100 < np.abs(np.concatenate(places)).max() <= 30_000


@pytest.mark.parametrize("size", [(640, 480), (641, 487)])
def test_a_frame_does_not_depend_on_those_before(size):
    """Only what changes is drawn anew: nothing of it may stay behind or be missing."""
    rng, renderer = np.random.default_rng(0), Renderer(RIG, *size)
    for k in range(12):
        target, path = rng.uniform((0.3, -0.2), (0.7, 0.2)), rng.uniform((0.2, -0.3), (0.9, 0.3), (k, 2))
        piston = tuple(rng.uniform((-0.09, -0.18), (0.09, 0.18))) if k % 5 else (NAN, 0.0)
        drawn = {"target": tuple(target), "compliant_target": tuple(target + rng.normal(0, 0.03, 2)), "path": path}
        told = {"user_force": tuple(rng.normal(0, 60, 2)), "pressures": tuple(rng.uniform(1e5, 7e5, 4))}
        scene = changed(time=0.1 * k, piston=piston, stiffness=(1e3 * k, 2e3), **drawn, **told)
        np.testing.assert_array_equal(renderer.frame(scene), Renderer(RIG, *size).frame(scene))


def test_a_path_is_broken_at_gaps_and_drawn_elsewhere():
    path = np.array([[0.45, -0.1], [0.55, -0.1], [NAN, 0.0], [0.45, -0.2], [0.55, -0.2]])
    picture = RENDERER.frame(changed(path=path))

    def darker(point):
        column, row = (int(v) for v in RENDERER.to_pixel(point))
        return picture[row - 2 : row + 3, column - 2 : column + 3].min() < 205

    assert darker((0.5, -0.1))
    assert darker((0.5, -0.2))
    assert not darker((0.5, -0.15))


SCRIPT = """
import sys
import numpy as np
import birthsim_env.env, birthsim_env.vector_env
assert "pygame" not in sys.modules, "importing must not load pygame"
from birthsim_env import Parameters
import birthsim_env.drawing.rendering as rendering
scene = rendering.Scene(0.0, (0.0, 0.0), (0.5, 0.0), (0.5, 0.0), (0.0, 0.0), (2e5,) * 4, (1.0, 1.0), np.zeros((0, 2)))
rendering.Renderer(Parameters()).frame(scene)
import pygame
assert not pygame.display.get_init() and not pygame.mixer.get_init()
print("done")
"""


def test_frames_need_no_display_and_pygame_is_loaded_late():
    hidden = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")}
    result = subprocess.run([sys.executable, "-c", SCRIPT], env=hidden, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "done\n"
    assert "ALSA" not in result.stderr


def test_the_window_shows_the_frame_keeps_pace_and_closes(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Renderer(RIG, 320, 240)
    window.show(SCENE, 50.0)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
    np.testing.assert_array_equal(shown, window.frame(SCENE))
    begin = time.perf_counter()
    for _ in range(10):
        window.show(SCENE, 50.0)
    assert time.perf_counter() - begin > 0.17
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for _ in range(2):
        window.show(SCENE, 1000.0)
        assert not pygame.display.get_init(), "closed by the user it stays closed until close()"
    window.close()
    window.show(SCENE, 1000.0)
    assert pygame.display.get_init()
    window.close(), window.close()
    assert not pygame.display.get_init()
