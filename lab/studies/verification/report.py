"""The page docs/verification.md from stored measurements and tables."""

import tomllib
from pathlib import Path
from typing import Any

from lab.engine.results import read_result
from lab.studies.accuracy import tables as accuracy_tables
from lab.studies.verification import mutants, sources

PAGE = sources.ROOT / "docs" / "verification.md"
HERE = Path(__file__).parent

INTRODUCTION = """# Verification

How the physics and the controllers were checked, and what was found. `make verify` measures accuracy and balances and writes
this page; `make verify-slow` also measures mutation scores and coverage ({minutes} minutes).
"""

EQUATIONS = """## Equations

Each equation is computed in one place and compared with something independent. Numbers in brackets are the paper's.
"""

ACCURACY = """## Accuracy of the integrator

The plant moves in classical Runge-Kutta steps of {step:g} ms each. A second model has other coordinates and states, and
SciPy's DOP853 integrates it with a tolerance of 1e-11 (`birthsim study accuracy`). Rigs are the nominal one, extreme and
random corners of the ranges, and random ones. In motions of 0.5 s short puffs make both pistons stick and slip, or valves
open to 0.7 and a hand of 80 N jerks. The error is the largest at any of 50 marks.

{worst}

A tracker's noise is 100 um. On some random rigs steps of 0.5 ms are unstable or wrong by millimetres, so 0.25 ms is not too
small. At kinks, where friction reverses or a valve shuts, no method keeps its order. {itself}

![Error against step and cost](accuracy.svg)
"""

BALANCES = """## Balances

The test adds up flows, work and heat of every chamber in the plant's Runge-Kutta stages, and compares the sums with what the
chambers hold. The gap is the largest relative difference of any chamber at any mark of 20 ms.
"""

MUTATION = """## Mutation scores

One operator, number or function name is changed at a time ("one in 3": every third), and the module's tests run, uncompiled,
until one fails. The score is the share of changes that some test notices. Slow tests are left
out, so all tests notice at least as much. Data, interfaces and estimators have no score.
"""

SURVIVORS = """### Survivors

No test noticed these changes. Equivalent: no input shows the change. Numerical: it is below any meaningful tolerance. Out of
reach: only inputs that callers exclude show it. Missing test: a test would notice.
"""

COVERAGE = """## Coverage

The kernels run as plain Python here, under the {tests} tests of the mutation scores.
"""

PROMISES = """## Promises

What the documentation promises, and the tests that check it. A bound is what those tests allow.
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
    content, lines = read_result("accuracy") or {}, []
    found = content["figures"]
    for motion in found["motions"]:
        position, pressure, rig = accuracy_tables.worst(found, motion)
        lines.append(
            f'- Motion "{motion}": at most {accuracy_tables.number(1e6 * position)} um (on the rig "{rig}") and '
            f"{accuracy_tables.number(pressure)} of a pressure."
        )
    doubt = max(one["reference_itself"]["position_m"] for one in found["motions"].values())
    itself = f"With ten times its tolerance the reference itself moves by {accuracy_tables.number(1e6 * doubt)} um."
    text = ACCURACY.format(step=1e3 * found["present_step_s"], worst="\n".join(lines), itself=itself)
    return f"{text}\nMeasured at commit {content['commit'][:7]}.\n\n{accuracy_tables.tables(found)}\n"


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
        f"{mechanical[0]['work_j']:.0f} J the relative gap is {gaps}."
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
