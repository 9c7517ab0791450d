"""The C header, and examples with CMake and pkg-config."""

from collections.abc import Mapping
from pathlib import Path

from birthsim_build.bundle import LAW, PLANT
from birthsim_build.code.blocks import WIDTH
from birthsim_build.code.threads import MISSED
from birthsim_build.image import HEAD, Words
from birthsim_build.layout import LAYOUT, ROWS
from birthsim_env import __version__

HERE = Path(__file__).resolve().parent
STATIC = ("CMakeLists.txt", "birthsim.pc")

_WORKED_PLANT = """
 * The plant alone:
 *
 *     birthsim_word loop[BIRTHSIM_PLANT_WORDS];
 *     birthsim_begin(loop, birthsim_plant, BIRTHSIM_PLANT_WORDS);
 *     birthsim_set(loop, BIRTHSIM_OPENING_P1, 0.1);
 *     birthsim_advance(loop, 10);
 *     double x = birthsim_get(loop, BIRTHSIM_X);
 *"""
_WORKED_LAW = """
 * A controller alone, in a firmware's own loop; controller.c is a whole program:
 *
 *     static birthsim_word law[BIRTHSIM_@NAME@_WORDS];
 *     birthsim_begin(law, birthsim_@name@, BIRTHSIM_@NAME@_WORDS);     once, and to reset it
 *
 *     then once per BIRTHSIM_PERIOD:
 *     birthsim_set(law, BIRTHSIM_TIME, periods * BIRTHSIM_PERIOD);    s since it began
 *     birthsim_set(law, BIRTHSIM_MEASURED_X, ...);                    _Y, m, and _VX, _VY, m/s: of the end effector
 *     birthsim_set(law, BIRTHSIM_POSITION_TIME, ...);                 when that position was taken, on the same clock, s
 *     birthsim_set(law, BIRTHSIM_MEASURED_PP1, ...);                  _PN1, _PP2, _PN2, Pa absolute
 *     birthsim_set(law, BIRTHSIM_MEASURED_FORCE_X, ...);              _Y, of the hand, N, for a law that reads it
 *     birthsim_set(law, BIRTHSIM_REFERENCE_X, ...);                   15 rows: target, its derivatives, stiffness
 *     int32_t refused = birthsim_advance(law, 1);                     not 0: that reference cannot be served
 *     double opening = birthsim_get(law, BIRTHSIM_OPENING_P1);        _N1, _P2, _N2, from -1 to 1
 *
 * A sample that is missing is set to NAN: the law goes on with the last good one and counts the period (BIRTHSIM_MISSED).
 * BIRTHSIM_FAULT is 1 until every signal was good once, and 2 when one was missing for too long: the valves then stay shut, or
 * vent where the law was built so, until it is begun anew.
 *"""


def write_header(images: Mapping[str, Words], period: float, folder: Path, told: str = "") -> None:
    """Write ``birthsim.h`` into ``folder``; ``period`` is a control period, s, ``told`` what ``beliefs`` says."""
    rows = "\n".join(
        f"  BIRTHSIM_{row.name.upper()} = {row.number}, /* {row.about}, {row.unit}"
        + (f"; the first of {row.count} */" if row.count > 1 else " */")
        for row in LAYOUT
    )
    loops = "\n".join(
        f"#define BIRTHSIM_{name.upper()}_WORDS {len(words)}\nextern const birthsim_word birthsim_{name}[{len(words)}];"
        for name, words in images.items()
    )
    examples = "".join(
        f"\n/* The loop of {program}.c. */\n#define BIRTHSIM_{program.upper()} birthsim_{name}\n"
        for program, name in _programs(images).items()
    )
    law = _programs(images).get("controller", "")
    worked = [_WORKED_PLANT] * (PLANT in images)
    worked += [_WORKED_LAW.replace("@NAME@", law.upper()).replace("@name@", law)] * bool(law)
    text = (HERE / "birthsim.h").read_text()
    for mark, value in (
        *(("HEAD", str(HEAD)), ("ROWS", str(ROWS)), ("ENUM", rows), ("LOOPS", loops), ("EXAMPLES", examples)),
        *(("PERIOD", repr(period)), ("BELIEFS", told), ("WORKED", " *" + "".join(worked))),
        ("WHAT", "controllers" if set(_programs(images)) == {"controller"} else "closed loops"),
    ):
        text = text.replace(f"@{mark}@", value)
    (folder / "birthsim.h").write_text(text)


def _programs(images: Mapping[str, Words]) -> dict[str, str]:
    """Examples that can be run, and the loop or the law that each runs: the first."""
    laws = [name for name in images if name.startswith(LAW)]
    loops = [name for name in images if name != PLANT and name not in laws]
    return {program: names[0] for program, names in (("example", loops), ("controller", laws)) if names}


def write_kernels(folder: Path) -> None:
    """Write ``kernels.h``, which says how the kernels of a GPU are launched."""
    text = (HERE / "kernels.h").read_text()
    for mark, value in (("MISSED", MISSED), ("WIDTH", WIDTH)):
        text = text.replace(f"@{mark}@", str(value))
    (folder / "kernels.h").write_text(text)


def write_examples(images: Mapping[str, Words], folder: Path, linked: bool = True) -> None:
    """Write the examples and, where they are ``linked`` with a library, how to build them."""
    programs = [f"{program}.c" for program in _programs(images)]
    for name in [*programs, *(STATIC if linked and programs else ())]:
        (folder / name).write_text((HERE / name).read_text().replace("@VERSION@", __version__))
