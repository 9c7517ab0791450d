"""Markdown tables of what ``validation`` has measured."""

from typing import Any

from lab.engine.tables import markdown
from lab.studies.validation.seals import BARS
from lab.studies.validation.tubes import FITTED


def tables(found: dict[str, Any]) -> dict[str, str]:
    """Tables by subject."""
    makers = {"seals": _seals, "valve": _valve, "tubes": _tubes}
    return {subject: makers[subject](found[subject]) for subject in found}


def _range(values: list[float]) -> str:
    return f"{min(values):.2f} to {max(values):.2f}"


def _seals(found: dict[str, Any]) -> str:
    """Levels, errors of each model, and parameters."""
    levels = [["seal", *(f"{bar} bar, N" for bar in BARS)]]
    errors = [["seal", "law", "one level", "F0 + k p", "pressure not fitted", "fitted at each pressure"]]
    numbers = [["seal", "law", "F0, N", "k, N/bar", "Fs/Fc", "Stribeck speed, mm/s", "s0, N/m", "viscous, N s/m"]]
    for seal, one in found.items():
        levels.append([seal, *(f"{value:.1f}" for value in one["levels"])])
        for law, model in one["models"].items():
            own = model["parameters"]
            errors.append([seal, law, *(_range(model[name]) for name in ("one_level", "by_pressure", "foretold", "own"))])
            numbers.append(
                [
                    *(seal, law, f"{own['f0']:.2f}", f"{own['per_bar']:.2f}", f"{own['static_ratio']:.2f}"),
                    *(f"{1e3 * own['stribeck_speed']:.0f}", f"{own['bristle_stiffness']:.0f}", f"{own['viscous']:.0f}"),
                ]
            )
    return "\n\n".join(
        [
            "Friction of sliding, half the difference of both directions:",
            markdown(levels),
            "What a model leaves of the friction, N RMS at the least and at the most erring of four pressures:",
            markdown(errors),
            "Parameters of F0 + k p:",
            markdown(numbers),
        ]
    )


def _valve(found: dict[str, Any]) -> str:
    rows = [
        ["characteristic", "overlap", "curvature", "largest error, % of full flow"],
        ["linear", "0", "0", f"{100 * found['linear']:.1f}"],
        ["two numbers, fitted", *(f"{found[name]:.3f}" for name in ("overlap", "curvature")), f"{100 * found['largest']:.1f}"],
    ]
    return markdown(rows)


def _tubes(found: dict[str, Any]) -> str:
    """Errors by length, and what was fitted."""
    lengths = found["by_length"]
    own = found["parameters"]
    named = ", ".join(f"{length}" for length in FITTED)
    errors = [
        ["tube", *(f"{length} m" for length in lengths), f"fitted on: {named} m", "foretold: the others", "all"],
        [
            "error, bar RMS",
            *(f"{value:.2f}" for value in (*lengths.values(), *(found[name] for name in ("fitted", "foretold", "all")))),
        ],
    ]
    numbers = [
        ["bore of the tube, mm", "filling, m3/(s Pa)", "venting, m3/(s Pa)", "lag of the valve, ms"],
        [f"{1e3 * own['bore']:.1f}", f"{own['filling']:.1e}", f"{own['venting']:.1e}", f"{1e3 * own['lag']:.1f}"],
    ]
    return "\n\n".join(
        [markdown(errors), "What was fitted, beside a dead time for each supply pressure and way:", markdown(numbers)]
    )
