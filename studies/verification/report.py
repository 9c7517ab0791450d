"""The page docs/verification.md from stored measurements and tables."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from studies.accuracy import tables as accuracy_tables
from studies.verification import mutants, sources

PAGE = sources.ROOT / "docs" / "verification.md"
HERE = Path(__file__).parent

INTRODUCTION = """# Verification

This page says how the physics and the laws were checked, and what the checks found. The page is generated: edit
`studies/verification/`, not this file. `make verify` measures accuracy and balances and writes the page anew.
`make verify-slow` also measures mutation scores and coverage. The mutants and the coverage below took {minutes} minutes;
the choice of the tests comes on top.
"""

EQUATIONS = """## Equations

Numbers in brackets are the paper's. Each equation is computed in one place and compared with something independent.
"""

ACCURACY = """## Accuracy of the integrator

The plant takes classical Runge-Kutta steps of {step:g} ms. `birthsim study accuracy` compares it with a second model of the
rig. That model has other coordinates and other states, and SciPy's DOP853 integrates it with a tolerance of 1e-11.

- The rigs are the nominal one, two extreme corners of the ranges of randomisation, random corners, and random draws.
- Two motions of 0.5 s are measured. In the first, short puffs of air make both pistons stick and slip. In the second, valves
  open to 0.7 and the hand jerks with 80 N.
- The error is the largest at any of the 50 marks.

{worst}

A tracker's noise is 100 um, so integration adds nothing that a sensor could see. On some drawn rigs steps of 0.5 ms are
unstable or wrong by millimetres, so 0.25 ms is not too small. Where friction reverses or a valve shuts, the equations have
kinks. There no method keeps its order, and adaptive methods lose their advantage. {itself}

![Error against step and cost](accuracy.png)
"""

BALANCES = """## Balances

Mass and energy must balance. The test adds up flows, work and heat of every chamber in the same Runge-Kutta stages as the
plant. Then it compares the sums with what the chambers hold. The gap is the largest relative difference of any chamber at
any mark of 20 ms.
"""

MUTATION = """## Mutation scores

`birthsim study mutation` changes one operator, number or function name at a time and runs the module's tests, uncompiled,
until one fails. The score is the share of changes that some test notices. "One in 3" means that every third change was tried.
Tests that need more than a few seconds uncompiled are left out, so the full set of tests notices at least as much. Files of
data and interfaces (`parameters`, `quantities`, `lanes`, `plant`, `compilation`) and the estimators have no score.
"""

SURVIVORS = """### Survivors

A survivor is a change that no test noticed. Each has a verdict.

- Equivalent: no input tells the change from the original, or it only makes scratch space larger.
- Numerical: it changes results by less than any tolerance that means something.
- Out of reach: only inputs that callers exclude tell the two apart.
- Missing test: a test would notice.
"""

COVERAGE = """## Coverage

The lines of compiled code cannot be counted. So the kernels run as plain Python here, under the {tests} tests that the
mutation tester uses. Tests that are too slow uncompiled are left out; they run compiled in `make test`.
"""

PROMISES = """## Promises

The table lists what the documentation promises, and the tests that check it. A bound is what those tests allow. Another
test checks that every test named here exists, and that every bound stands in its file.
"""


def page() -> str:
    """The whole page."""
    seconds = sources.load("coverage")["seconds"] + sum(one["seconds"] for one in sources.load("mutation").values())
    parts = (
        INTRODUCTION.format(minutes=round(seconds / 60)),
        equations(),
        accuracy(),
        balances(),
        mutation(),
        coverage(),
        promises(),
    )
    return "\n".join(parts)


def table(heads: list[str], rows: list[list[str]]) -> str:
    """A Markdown table with a line break after it."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def entries(name: str) -> list[dict[str, Any]]:
    """The entries of ``equations.toml`` or ``promises.toml``."""
    content = tomllib.loads((HERE / f"{name}s.toml").read_text(encoding="utf-8"))
    found: list[dict[str, Any]] = content[name]
    return found


def tests_in_words(nodes: list[str]) -> str:
    """Test functions with their files."""
    return ", ".join(f"`{node.removeprefix('tests/')}`" for node in nodes)


def equations() -> str:
    """Equation, code, oracle, tests."""
    rows = [
        [one["name"], ", ".join(f"`{place}`" for place in one["code"]), one["oracle"], tests_in_words(one["tests"])]
        for one in entries("equation")
    ]
    return EQUATIONS + "\n" + table(["equation", "computed in", "compared with", "test"], rows)


def basis(measured: dict[str, Any]) -> str:
    """The commit of a measurement, and a warning where its sources have changed since."""
    changed = sources.changed(measured["sources"])
    stale = f" **Stale**: {len(changed)} of {len(measured['sources'])} files have changed since." if changed else ""
    return f"Measured at commit {measured['commit']}.{stale}\n"


def accuracy() -> str:
    """Errors, orders and the figure."""
    found, lines = sources.load("accuracy"), []
    for motion in found["motions"]:
        position, pressure, rig = accuracy_tables.worst(found, motion)
        lines.append(
            f'- Motion "{motion}": at most {accuracy_tables.number(1e6 * position)} um (on the rig "{rig}") and '
            f"{accuracy_tables.number(pressure)} of a pressure."
        )
    doubt = max(one["reference_itself"]["position_m"] for one in found["motions"].values())
    itself = f"With ten times its tolerance the reference itself moves by {accuracy_tables.number(1e6 * doubt)} um."
    text = ACCURACY.format(step=1e3 * found["present_step_s"], worst="\n".join(lines), itself=itself)
    return f"{text}\n{basis(found)}\n{accuracy_tables.tables(found)}\n"


def balances() -> str:
    """Gaps of mass and energy by step, the adiabat, mechanical energy."""
    found = sources.load("balances")
    rows = [
        [
            "clear of the stops, 2 s" if name == "clear" else f"{one['pistons_at_stops']} pistons meet stops, 0.2 s",
            *(str(one["lanes"]), f"{1e3 * one['step_s']:g}", f"{one['mass']:.1e}", f"{one['energy']:.1e}"),
        ]
        for name in ("clear", "collisions")
        for one in found[name]
    ]
    adiabat, mechanical = found["adiabat"], found["mechanical"]
    squeezed = f"{100 * adiabat['squeezed']:.0f} %"
    gaps = ", ".join(f"{one['gap']:.1e} with steps of {1e3 * one['step_s']:g} ms" for one in mechanical)
    more = (
        f"Insulated chambers, squeezed by up to {squeezed}, keep P V^gamma to {adiabat['drift']:.1e}.\n\n"
        "Kinetic and potential energy change by the work of pressures and hand less that of friction. Over 2 s and "
        f"{mechanical[0]['work_j']:.0f} J the gap, relative to the work, is {gaps}. Trapezoids of one step sum up the work."
    )
    heads = ["motion", "lanes", "step (ms)", "gap of mass", "gap of energy"]
    return f"{BALANCES}\n{basis(found)}\n{table(heads, rows)}\n{more}\n"


def mutation() -> str:
    """Scores by module, and every survivor with its judgement."""
    found, judged, rows, alive = sources.load("mutation"), mutants.judgements(), [], []
    for module, one in found.items():
        stale = "no" if sources.changed(one["sources"]) else "yes"
        left = len(one["left_out"])
        sample = "all" if one["every"] == 1 else f"one in {one['every']}"
        counts = [sample, str(one["tried"]), str(one["killed"]), f"{100 * mutants.score(one):.1f} %"]
        rows.append([f"`{sources.path_of(module)}`", *counts, f"{len(one['tests'])} ({left} left out)", one["commit"], stale])
        for name, mutant in one["survivors"].items():
            verdict = judged.get(name, {"verdict": "not judged", "reason": ""})
            change = mutant["change"].replace("|", "\\|")
            place = f"`{Path(sources.path_of(module)).name}`, `{name.split(':')[1]}`"
            alive.append([place, f"`{change}`", verdict["verdict"], verdict["reason"]])
    tried, killed = (sum(one[key] for one in found.values()) for key in ("tried", "killed"))
    rows.append(["together", "", str(tried), str(killed), f"{100 * killed / tried:.1f} %", "", "", ""])
    heads = ["module", "sample", "changes", "noticed", "score", "tests", "commit", "up to date"]
    verdicts = ", ".join(f"{sum(row[2] == verdict for row in alive)} {verdict}" for verdict in mutants.VERDICTS)
    survivors = table(["where", "change", "verdict", "why"], alive)
    return f"{MUTATION}\n{table(heads, rows)}\n{SURVIVORS}\n{len(alive)} survivors: {verdicts}.\n\n{survivors}"


def coverage() -> str:
    """Lines and branches by file, with those that were missed."""
    found, rows = sources.load("coverage"), []
    for path, one in found["files"].items():
        missed, jumps = one["lines_missed"], one["branches_missed"]
        words = [*(f"line {line}" for line in missed), *(f"{start} to {end}" for start, end in jumps if start not in missed)]
        lines, branches = one["lines"], one["branches"]
        reached = [f"{lines - len(missed)} of {lines}", f"{branches - len(jumps)} of {branches}"]
        rows.append([f"`{path}`", *reached, ", ".join(words) or "none"])
    text = COVERAGE.format(tests=found["tests"])
    return f"{text}\n{basis(found)}\n{table(['file', 'lines', 'branches', 'missed'], rows)}"


def promises() -> str:
    """Promise, where it is made, bounds, tests."""
    rows = []
    for one in entries("promise"):
        bounds = "; ".join(f"{what}: {bound}" for what, bound in one.get("bounds", {}).items())
        page = Path(one["made"])
        link = "this page" if page.name == PAGE.name else f"[{page.name}]({'../' if page.parent == Path() else ''}{page.name})"
        rows.append([one["text"], link, bounds or "exact or by case", tests_in_words(one["tests"])])
    return PROMISES + "\n" + table(["promise", "made in", "bound", "test"], rows)
