"""Pictures of the rig for Gymnasium's render modes ``rgb_array``, which needs no display, and ``human``."""

import math
import os

import gymnasium
import pygame

from birthsim_env.drawing.picture import Picture
from birthsim_env.drawing.scene import Scene, checked_size
from birthsim_env.physics.rig.parameters import Parameters

UNSEEN = ("dummy", "offscreen")
"""SDL's drivers that show nothing, which it takes where it finds no display."""

__all__ = ["Renderer", "Scene"]


class Renderer(Picture):
    """Draws scenes of one rig; the static part, the typefaces and the scale are prepared once.

    ``parameters`` fix the world that is shown: the whole workspace always fits. ``width`` and ``height`` are the picture's
    size in px, from 320 x 240 to 7680 x 4320; others raise ``ValueError``.
    """

    def __init__(self, parameters: Parameters, width: int = 640, height: int = 480) -> None:
        super().__init__(parameters, *checked_size("(width, height)", (width, height)))
        self._window: pygame.Surface | None = None
        self._clock: pygame.time.Clock | None = None
        self._dismissed = False

    def show(self, scene: Scene, frames_per_second: float) -> None:
        """Show ``scene`` in a window and wait so that calls come no faster than ``frames_per_second``.

        Once the user has closed the window, calls do nothing until ``close`` has been called: the run itself goes on.
        """
        if not (math.isfinite(frames_per_second) and frames_per_second > 0):
            raise ValueError(f"frames_per_second = {frames_per_second!r}; allowed: a finite number > 0")
        if self._dismissed:
            return
        if self._window is None or self._clock is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((self.width, self.height))
            if "SDL_VIDEODRIVER" not in os.environ and pygame.display.get_driver() in UNSEEN:
                gymnasium.logger.warn("render_mode = 'human', but there is no display; allowed without one: 'rgb_array'")
            pygame.display.set_caption("BirthSIM")
            self._clock = pygame.time.Clock()
        self.draw(scene)
        self._window.blit(self.surface, (0, 0))
        pygame.display.flip()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()
            self._dismissed = True
            return
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Close the window, if there is one. The renderer can be used again."""
        if self._window is not None:
            pygame.display.quit()
        self._window = self._clock = None
        self._dismissed = False
