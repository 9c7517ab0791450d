"""Pictures of the rig for Gymnasium's render modes ``rgb_array`` and ``human``.

pygame is imported when the first ``Renderer`` is made, so that training without pictures never loads it; ``rgb_array``
needs no display.
"""

import importlib
import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from birthsim_env.drawing.scene import Scene
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import shown

if TYPE_CHECKING:
    import pygame

UNSEEN = ("dummy", "offscreen")
"""SDL's drivers that show nothing, which it takes where it finds no display."""

__all__ = ["PairRenderer", "Renderer", "Scene"]


LEAST, LARGEST = (320, 240), (7680, 4320)
"""px: sizes of a picture."""


def checked_size(name: str, size: Sequence[int]) -> tuple[int, int]:
    """``size`` (width, height) in px, or a ``ValueError`` that names it, its value and what is allowed."""
    given = np.asarray(size if isinstance(size, (tuple, list, np.ndarray)) and len(size) == 2 else None)
    if given.shape != (2,) or given.dtype.kind not in "iu" or np.any(given < LEAST) or np.any(given > LARGEST):
        (w, h), (wide, high) = LEAST, LARGEST
        raise ValueError(f"{name} = {shown(size)}; allowed: two whole numbers from {w} x {h} to {wide} x {high} px")
    return int(given[0]), int(given[1])


def _load() -> Any:
    """Pygame without its greeting, which would end up in the output of the console commands."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    return importlib.import_module("pygame")


def _pixels(surface: "pygame.Surface") -> NDArray[np.uint8]:
    """A fresh copy (height, width, 3), RGB."""
    width, height = surface.get_size()
    pixels = np.empty((height, width, 3), dtype=np.uint8)
    # SDL converts into the array itself, five times as fast as by way of bytes.
    _load().image.frombuffer(pixels.data, (width, height), "RGB").blit(surface, (0, 0))
    return pixels


class Renderer:
    """Draws scenes of one rig; the static part, the typefaces and the scale are prepared once.

    ``parameters`` fix the world that is shown: the whole workspace always fits. ``width`` and ``height`` are the picture's
    size in px, from 320 x 240 to 7680 x 4320; others raise ``ValueError``.
    """

    def __init__(self, parameters: Parameters, width: int = 640, height: int = 480) -> None:
        width, height = checked_size("(width, height)", (width, height))
        self._pygame = _load()
        from birthsim_env.drawing.picture import Picture

        self.parameters, self.width, self.height = parameters, width, height
        self._picture = Picture(parameters, width, height)
        self._window: pygame.Surface | None = None
        self._clock: pygame.time.Clock | None = None
        self._dismissed = False

    def to_pixel(self, point: tuple[float, float]) -> tuple[float, float]:
        """Pixel (column, row) of a world point (x, y), m, in the main view; whole numbers are pixel edges."""
        return self._picture.pixel(point)

    def frame(self, scene: Scene) -> NDArray[np.uint8]:
        """Draw the picture of ``scene`` as (height, width, 3) RGB; a fresh array each time."""
        self._picture.draw(scene)
        return _pixels(self._picture.surface)

    def show(self, scene: Scene, frames_per_second: float) -> None:
        """Show ``scene`` in a window and wait so that calls come no faster than ``frames_per_second``.

        Once the user has closed the window, calls do nothing until ``close`` has been called: the run itself goes on.
        """
        if not (math.isfinite(frames_per_second) and frames_per_second > 0):
            raise ValueError(f"frames_per_second = {frames_per_second!r}; allowed: a finite number > 0")
        if self._dismissed:
            return
        pygame = self._pygame
        if self._window is None or self._clock is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((self.width, self.height))
            if "SDL_VIDEODRIVER" not in os.environ and pygame.display.get_driver() in UNSEEN:
                gymnasium.logger.warn("render_mode = 'human', but there is no display; allowed without one: 'rgb_array'")
            pygame.display.set_caption("BirthSIM")
            self._clock = pygame.time.Clock()
        self._picture.draw(scene)
        self._window.blit(self._picture.surface, (0, 0))
        pygame.display.flip()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()
            self._dismissed = True
            return
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Close the window, if there is one. The renderer can be used again."""
        if self._window is not None:
            self._pygame.display.quit()
        self._window = self._clock = None
        self._dismissed = False


class PairRenderer:
    """Draws two runs of the same world beside each other, ``width`` px wide: rig, magnifier and error over time of each.

    ``title`` stands over both, ``names`` over each; the errors' axes reach over ``span`` (s, from and to) and to ``top`` (m).
    """

    def __init__(
        self, parameters: Parameters, title: str, names: Sequence[str], span: tuple[float, float], top: float, width: int = 960
    ) -> None:
        _load()
        from birthsim_env.drawing.pair import Pair

        self._picture = Pair(parameters, title, names, span, top, width)

    def frame(
        self, scenes: Sequence[Scene], times: NDArray[np.float64], errors: Sequence[NDArray[np.float64]]
    ) -> NDArray[np.uint8]:
        """Draw two scenes, and the errors (m) at all ``times`` (s) so far, as (height, width, 3) RGB."""
        self._picture.draw(scenes, times, errors)
        return _pixels(self._picture.surface)
