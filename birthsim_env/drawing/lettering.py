"""Text on pictures, in the typeface of the figures."""

import importlib.util
import math
from collections.abc import Sequence
from pathlib import Path

import pygame
import pygame.font

from birthsim_env.drawing.pen import INK, PAPER, Colour, Point, drawable


def _typeface(name: str) -> Path | None:
    """A typeface of the figures, found without loading matplotlib; None, pygame's own, where matplotlib keeps it elsewhere."""
    found = importlib.util.find_spec("matplotlib")
    if found is None or found.origin is None:
        return None
    path = Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / f"{name}.ttf"
    return path if path.is_file() else None


class Lettering:
    """Text with every rendered string kept, since most strings return frame after frame."""

    def __init__(self, size: int, bold: bool = False) -> None:
        """``size`` is the height of the letter m's quad, px."""
        if not pygame.font.get_init():
            pygame.font.init()
        # Rendered at four times the size and scaled down: at text size the typeface's own hinting leaves gaps inside words.
        self._font = pygame.font.Font(_typeface("DejaVuSans-Bold" if bold else "DejaVuSans"), 4 * size)
        self.height = self._font.get_height() // 4
        self._kept: dict[tuple[str, Colour, bool], pygame.Surface] = {}

    def width(self, text: str) -> int:
        """Width of a text, px."""
        return math.ceil(self._font.size(text)[0] / 4)

    def fit(self, choices: Sequence[str], width: float) -> str:
        """Return the first choice that fits in ``width`` px, else the last one cut short."""
        for text in choices:
            if self.width(text) <= width:
                return text
        text = choices[-1]
        while text and self.width(text + "...") > width:
            text = text[:-1]
        return text + "..." if text else ""

    def write(
        self,
        surface: pygame.Surface,
        text: str,
        at: Point,
        colour: Colour = INK,
        anchor: Point = (0.0, 0.0),
        halo: bool = False,
    ) -> None:
        """Write ``text`` with the point ``anchor`` of its box, (0, 0) top left to (1, 1) bottom right, at the pixel ``at``."""
        if not drawable([at]):
            return
        key = (text, colour, halo)
        image = self._kept.get(key)
        if image is None:
            if len(self._kept) > 4000:
                self._kept.clear()
            image = self._kept[key] = self._render(text, colour, halo)
        surface.blit(image, (round(at[0] - anchor[0] * image.get_width()), round(at[1] - anchor[1] * image.get_height())))

    def _render(self, text: str, colour: Colour, halo: bool) -> pygame.Surface:
        plain = self._small(text, colour)
        if not halo:
            return plain
        image = pygame.Surface((plain.get_width() + 4, plain.get_height() + 4), pygame.SRCALPHA)
        light = self._small(text, PAPER)
        for dx in range(5):
            for dy in range(5):
                image.blit(light, (dx, dy))
        image.blit(plain, (2, 2))
        return image

    def _small(self, text: str, colour: Colour) -> pygame.Surface:
        large = self._font.render(text, True, colour)
        return pygame.transform.smoothscale(large, (math.ceil(large.get_width() / 4), math.ceil(large.get_height() / 4)))
