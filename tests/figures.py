"""What the style asks of every figure, looked up in the drawn figure itself."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from baselines.figures.style import COLUMN, PAGE


def caught(monkeypatch: pytest.MonkeyPatch, written: bool = False) -> list[tuple[Figure, list[str]]]:
    """The figures that are drawn from now on and their faults; their files are ``written`` too, or not."""
    figures, save = list[tuple[Figure, list[str]]](), Figure.savefig

    def kept(self: Figure, file: Any, **options: Any) -> None:
        if options["format"] == "png":
            self.canvas.draw()
            figures.append((self, faults(self)))
        if written:
            save(self, file, **options)

    monkeypatch.setattr(Figure, "savefig", kept)
    return figures


def contrast(colour: object) -> float:
    """Contrast of a colour with white, 1 to 21, as WCAG 2 defines it."""
    channels = np.array(to_rgb(colour))
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(1.05 / (linear @ (0.2126, 0.7152, 0.0722) + 0.05))


def faults(figure: Figure) -> list[str]:
    """Sizes, titles, legends, colours and line styles that are not as the style wants them."""
    wide = np.isclose(figure.get_figwidth(), (COLUMN, PAGE)).any()
    found = [] if wide else ["neither a column nor a page wide"]
    found += [] if figure.get_suptitle() else ["no finding as title"]
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    for legend in legends:
        place = legend.get_window_extent()
        over = [axes for axes in figure.axes if axes.get_visible() and axes.get_window_extent().padded(-1).overlaps(place)]
        found += ["a legend lies on axes"] * bool(over)
        lines = [one for one in legend.legend_handles if isinstance(one, Line2D)]
        for one, other in combinations(lines, 2):
            found += [f"{one.get_label()} and {other.get_label()} differ in colour alone"] * (_form(one) == _form(other))
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            found += [f"{text.get_fontsize():g} pt: {text.get_text()}"] * (text.get_fontsize() < 7)
    found += [f"cut off: {text.get_text()}" for text in _titles(figure, legends) if not _inside(text, figure)]
    return found + [f"{colour}: contrast {contrast(colour):.2g}" for colour in _colours(figure) if contrast(colour) < 3]


def _form(line: Line2D) -> tuple[object, ...]:
    """What of a line's look a grey print keeps; half the width or less is another line."""
    hollow = line.get_marker() != "None" and np.allclose(to_rgba(line.get_markerfacecolor()), 1)
    return line.get_linestyle(), line.get_marker(), hollow, round(np.log2(line.get_linewidth()))


def _titles(figure: Figure, legends: list) -> list[Text]:
    texts = [*figure.texts, *(text for legend in legends for text in legend.findobj(Text))]
    for axes in figure.axes:
        texts += [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label]
    return [text for text in texts if text.get_text().strip() and text.get_visible() and text.axes in (None, *figure.axes)]


def _inside(text: Text, figure: Figure) -> bool:
    box, whole = text.get_window_extent(), figure.bbox.padded(1)
    return bool(box.x0 >= whole.x0 and box.y0 >= whole.y0 and box.x1 <= whole.x1 and box.y1 <= whole.y1)


def _colours(figure: Figure) -> set[object]:
    found: set[object] = set()
    for axes in figure.axes:
        found |= {line.get_color() for line in axes.get_lines() if line.get_alpha() is None}
        for one in axes.collections:
            if isinstance(one, LineCollection) and one.get_alpha() is None:
                found |= set(map(tuple, one.get_colors()))
    return found
