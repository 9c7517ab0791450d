"""The C header, and an example with CMake and pkg-config."""

from collections.abc import Mapping
from pathlib import Path

from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.threads import MISSED
from birthsim_build.image import HEAD, Words
from birthsim_build.layout import LAYOUT, ROWS
from birthsim_env import __version__

HERE = Path(__file__).resolve().parent
STATIC = ("example.c", "CMakeLists.txt", "birthsim.pc")
EXAMPLE = "BIRTHSIM_EXAMPLE"


def write_header(images: Mapping[str, Words], folder: Path, example: str | None = None) -> None:
    """Write ``birthsim.h`` into ``folder``; ``example`` is the loop that the example runs."""
    rows = "\n".join(
        f"  BIRTHSIM_{row.name.upper()} = {row.number}, /* {row.about}, {row.unit}"
        + (f"; the first of {row.count} */" if row.count > 1 else " */")
        for row in LAYOUT
    )
    loops = "\n".join(
        f"#define BIRTHSIM_{name.upper()}_WORDS {len(words)}\nextern const birthsim_word birthsim_{name}[{len(words)}];"
        for name, words in images.items()
    )
    chosen = "" if example is None else f"\n/* The loop of example.c. */\n#define {EXAMPLE} birthsim_{example}\n"
    text = (HERE / "birthsim.h").read_text()
    for mark, value in (("HEAD", str(HEAD)), ("ROWS", str(ROWS)), ("ENUM", rows), ("LOOPS", loops), ("EXAMPLE", chosen)):
        text = text.replace(f"@{mark}@", value)
    (folder / "birthsim.h").write_text(text)


def write_kernels(folder: Path) -> None:
    """Write ``kernels.h``, which says how the kernels of a GPU are launched."""
    text = (HERE / "kernels.h").read_text()
    for mark, value in (("MISSED", MISSED), ("WIDTH", WIDTH)):
        text = text.replace(f"@{mark}@", str(value))
    (folder / "kernels.h").write_text(text)


def write_example(folder: Path) -> None:
    """Write the example and how to build it."""
    for name in STATIC:
        (folder / name).write_text((HERE / name).read_text().replace("@VERSION@", __version__))
