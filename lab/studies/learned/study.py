"""What the shipped policies take off their controllers' errors, on worlds that no training used."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from agents.policy.files import WEIGHTS
from agents.policy.pieces import evaluate_learned
from agents.policy.seeds import as_table, policy_folders, seed_metrics
from baselines.bench.evaluation import DATA, data, merged
from baselines.bench.pieces import controller_settings, evaluation_tasks, file_hash, file_stem, gathered
from baselines.bench.statistics import jsonable
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, SPREAD_AND_WORST, Cell, Head, digits, markdown
from lab.engine.worlds import worlds
from lab.studies.learned import felt


class Run(NamedTuple):
    """Where the seeds of a policy run beside controllers."""

    environment: str
    episodes: int
    seed: int
    controllers: tuple[str, ...] = ("backstepping", "backstepping-force-first")
    sensors: str = "ideal"
    rig: str | None = None


RUNS = {
    "circle": Run("BirthSIM/Circle-v2", 256, 20000),
    "probe": Run("BirthSIM/Probe-v3", 128, 20000),
    "descent": Run("BirthSIM/Descent-v2", 64, 20000),
    "forceps": Run("BirthSIM/Forceps-v2", 128, 20000),
    "dystocia": Run("BirthSIM/Dystocia-v2", 128, 20000),
    "circle_lab": Run("BirthSIM/Circle-v2", 256, 20000, ("admittance-backstepping",), "lab"),
    "circle_pure": Run("BirthSIM/Circle-v2", 64, 20000, ("backstepping",)),
    "circle_honest_student": Run(
        "BirthSIM/Circle-v2", 128, 170000, ("admittance-sensorless", "backstepping-force-first"), "honest",
        "examples/honest_sensors_rig.toml",
    ),
    **{
        f"{name}_apg": Run(environment, episodes, 74_800_000, ("backstepping", "admittance-backstepping"))
        for name, environment, episodes in (
            ("circle", "BirthSIM/Circle-v2", 256), ("probe", "BirthSIM/Probe-v3", 128), ("descent", "BirthSIM/Descent-v2", 64),
            ("forceps", "BirthSIM/Forceps-v2", 128), ("dystocia", "BirthSIM/Dystocia-v2", 128),
            ("vacuum", "BirthSIM/Vacuum-v1", 128),
        )
    },
    "circle_residual_apg": Run("BirthSIM/Circle-v2", 256, 74_800_000),
    "circle_lab_apg": Run("BirthSIM/Circle-v2", 256, 74_800_000, ("admittance-backstepping", "admittance-adaptive"), "lab"),
}  # fmt: skip
"""Policy -> its run; seeds were never used for training or design."""

COMPARED = {
    "settled_rms": ("settled error, mm", 3),
    "pneumatic_rms_1": ("error of pneumatic stiffness 1, %", 2), "pneumatic_rms_2": ("of 2, %", 2), "air": ("air, l/min", 2),
}  # fmt: skip
"""Metric -> its column beside classical controllers, and how much a cell has of median, 95th percentile and worst."""


def _pieces(policy: str) -> dict[str, list[Task]]:
    """Controller or seed -> its pieces, of which the last is what a hand feels."""
    run = RUNS[policy]
    rig = load_parameters(ROOT / run.rig if run.rig else None)
    world, span = {"sensors": run.sensors, "randomize": True}, (run.episodes, run.seed)
    found = {}
    for name in run.controllers:
        own = controller_settings(name, rig)
        found[name] = evaluation_tasks(f"{policy}-{name}", own, run.environment, world, *span)
        found[name].append(Task(f"felt/{file_stem(name)}-{run.sensors}", felt.measure, {**own, "sensors": run.sensors}))
    for place in policy_folders(policy):
        network = file_hash(str(place / WEIGHTS))
        own = {"controller": "residual", "source": network, "rig": rig.to_dict(), "policy": str(place)}
        found[place.name] = evaluation_tasks(f"{policy}-{place.name}", own, run.environment, world, *span, evaluate_learned)
        found[place.name].append(Task(f"felt/{policy}-{place.name}", felt_by_learned, {**own, "sensors": run.sensors}))
    return found


def felt_by_learned(**settings: Any) -> Result:
    """What a hand feels of a policy, whose code this module imports, so that it counts."""
    return felt.measure(**settings)


def _tasks(options: Options) -> dict[Any, Task]:
    every = [(policy, who, pieces) for policy in options.policy for who, pieces in _pieces(policy).items()]
    return {(policy, who, k): task for policy, who, pieces in every for k, task in enumerate(pieces)}


def _kept(options: Options, found: Found) -> Any:
    kept = {}
    for policy in options.policy:
        names = dict.fromkeys(who for one, who, _ in found if one == policy)
        pieces = {who: [result for (one, own, _), result in found.items() if (one, own) == (policy, who)] for who in names}
        every = {who: gathered(who, own[:-1]) for who, own in pieces.items()}
        controllers, seeds = (
            [one for who, one in every.items() if (who in RUNS[policy].controllers) == classical] for classical in (True, False)
        )
        together = [*controllers, merged(seeds, f"residual, {len(seeds)} seeds")]
        felt_of = [[pieces[one.controller][-1]] for one in controllers] + [[pieces[one.controller][-1] for one in seeds]]
        kept[policy] = {
            "beside": {one.controller: seed_metrics(one, seeds) for one in controllers},
            "felt": {one.controller: felt.metrics_of(own) for one, own in zip(together, felt_of, strict=True)},
            "metrics": {"columns": list(DATA), "rows": list(csv.reader(io.StringIO(data(together))))[1:]},
        }
    return jsonable(kept)


def _shown(content: Content) -> dict[str, str]:
    rows: list[list[str]] = [["policy", *DATA]]
    parts: dict[bool, list[str]] = {True: [], False: []}
    for policy, found in content["figures"].items():
        run = RUNS[policy]
        world = f"{run.environment}, {run.episodes} episodes from seed {run.seed}, {run.sensors} sensors, randomised rigs."
        parts[policy.startswith("circle")] += [f"## {policy}", world, *map(as_table, found["beside"].values())]
        rows += [[policy, *row] for row in found["metrics"]["rows"]]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    summary = _summary(content["figures"])
    each = {
        f"learned-{where}.md": "\n\n".join(parts[on_circle]) + "\n"
        for where, on_circle in (("circle", True), ("elsewhere", False))
        if parts[on_circle]
    }
    return {"learned.md": _beside(content["figures"]), **each, "learned.csv": text.getvalue(), "residual.md": summary}


def _summary(figures: dict[str, Any]) -> str:
    """Pooled errors of each scenario's policy beside its controllers."""
    published = "paper's controller"
    with_residual = "controller underneath, mm", "with the residual, mm"
    head = ["scenario", f"{published}, mm", *with_residual, f"less than the {published}, %"]
    lines = [head, ["---"] * len(head)]
    shown = [policy for policy in ("circle", "probe", "forceps", "dystocia", "descent") if policy in figures]
    for policy in shown:
        own = {name: _row(found, "pooled RMS") for name, found in figures[policy]["beside"].items()}
        paper, under = (own[name] for name in RUNS[policy].controllers)
        less = _row(figures[policy]["beside"]["backstepping"], "less, pooled RMS")
        off = "-" if less[4] is None else f"{less[4]:.1f} ({less[5]:.1f} to {less[6]:.1f})"
        lines.append([policy.capitalize(), *map(digits, (paper[3], under[3], paper[4])), off])
    return f"{_worlds(shown)}\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _beside(figures: dict[str, Any]) -> str:
    """Policies beside classical controllers."""
    settled, *others = [Head(name, SPREAD_AND_WORST[:count]) for name, count in COMPARED.values()]
    heads = [settled, *(Head(name, SPREAD) for name in felt.COLUMNS.values()), *others]
    rows: list[list[Cell | Head]] = [["world, sensors", "controller", *information.COLUMNS, *heads, "lost"]]
    alike = []
    for policy, found in figures.items():
        every, world = found["metrics"]["rows"], f"{policy.partition('_')[0]}, {RUNS[policy].sensors}"
        for controller in dict.fromkeys(row[2] for row in every):
            own = {row[0]: row[1:] for row in every if row[2] == controller}
            tracks: list[Cell] = [
                list(map(_number, own[metric][2 : 2 + count])) if metric in own else "-"
                for metric, (_, count) in COMPARED.items()
            ]
            touch = [found["felt"][controller][name][:2] for name in felt.COLUMNS]
            learned = controller.startswith("residual")
            name = controller.replace("residual", policy) if learned else controller
            of, _, lost, *_ = own["lost episodes"]
            facts = information.informed(f"residual:{policy}" if learned else controller, RUNS[policy].sensors)
            rows.append([world, name, *facts, tracks[0], *touch, *tracks[1:], f"{lost} {of}"])
            alike.append((policy, facts[0], facts[2]))
    return f"{_worlds(figures)} {information.LEGEND}\n\n{markdown(rows, heads, alike=alike)}\n"


def _number(text: str) -> float | str:
    return float(text) if text[-1:].isdigit() else text


def _worlds(policies: Iterable[str]) -> str:
    """The worlds of ``policies``, in a sentence."""
    sets = dict.fromkeys((RUNS[policy].seed, RUNS[policy].episodes) for policy in policies)
    named = {one: [policy for policy in policies if (RUNS[policy].seed, RUNS[policy].episodes) == one] for one in sets}
    return " ".join(f"{worlds(*one)}: {', '.join(f'`{policy}`' for policy in own)}." for one, own in named.items())


def _by_gradients(content: Content) -> dict[str, str]:
    return {"gradients_policies.md": _beside(content["figures"])}


def _row(found: dict[str, Any], statistic: str) -> Sequence[Any]:
    """The row of the settled error's ``statistic``."""
    return next(row for row in found["rows"] if row[0] == "settled_rms" and row[2] == statistic)


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from agents.reports.learning_curves import draw_learning_curves, learning_curves

    return draw_learning_curves(learning_curves(policy_folders("circle")), folder)


SIDE_BY_SIDE = {
    "from_scratch": {"gradients": "circle_apg", "PPO": "circle_pure"},
    "ways_of_learning": {
        "gradients": "circle_apg",
        "gradients, on a controller": "circle_residual_apg",
        "PPO": "circle_pure",
        "PPO, on a controller": "circle",
    },
}
"""Picture -> what is side by side in it: a way of learning and the shipped policy that learned so, with ideal sensors."""


def _side_by_side(content: Content, folder: Path) -> list[Path]:
    from agents.reports.learning_curves import draw_side_by_side, learning_curves

    drawn = []
    for name, policies in SIDE_BY_SIDE.items():
        curves = {way: learning_curves(policy_folders(policy)) for way, policy in policies.items()}
        drawn += draw_side_by_side(curves, folder, name)
    return drawn


UNITS = {"settled_rms": "mm", "stiffness_error": "%", "noticed": "1", "energy": "mJ", "air": "l/min", "saturation": "%"}
GRADIENTS = tuple(name for name in RUNS if name.endswith("_apg"))
WORDS = {"policy": "shipped policies, each in its own worlds"}

BY_GRADIENTS = Study(
    {"policy": GRADIENTS},
    _tasks,
    _kept,
    UNITS,
    _by_gradients,
    _side_by_side,
    allowed={"policy": GRADIENTS},
    words=WORDS,
)
OTHERS = tuple(name for name in RUNS if name not in GRADIENTS)
STUDY = Study({"policy": OTHERS}, _tasks, _kept, UNITS, _shown, _pictures, allowed={"policy": OTHERS}, words=WORDS)
register(study="by-gradients", about="policies by gradients beside classical controllers")(BY_GRADIENTS)
register(study="learned", about="what shipped policies take off controllers' errors")(STUDY)
