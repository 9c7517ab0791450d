"""The control model in symbols of SymPy or CasADi, for derivations and optimisers of one's own.

It is the one that the nonlinear MPC computes with: ``horizon.rates`` and ``horizon.outputs`` are traced, and their operations
carried out on symbols. Mechanics are (5), chambers (6) with the dead volume, stiffnesses (9). (10) follows from these.
"""

import operator
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from baselines.rivals import horizon
from birthsim_env.assembly import one_of
from birthsim_env.gradients.evaluated import carried_out
from birthsim_env.gradients.graph import Graph
from birthsim_env.gradients.symbols import empty, inputs
from birthsim_env.gradients.tracing import call
from birthsim_env.physics.compiled.lanes import PARAMETERS, Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

SYMBOLS = {"x": "y1 y2 v1 v2 Pp1 Pn1 Pp2 Pn2", "q": "qp1 qn1 qp2 qn2", "f": "Fx Fy Fo1 Fo2"}
"""Block that the kernels read -> names of its rows."""

ALGEBRAS = ("sympy", "casadi")

ARITHMETIC: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "neg": operator.neg,
}  # fmt: skip


@dataclass(frozen=True)
class SymbolicModel:
    """Columns, ``sympy.Matrix`` or ``casadi.SX``, in SI units; ``rates`` and ``outputs`` are expressions of the other three.

    - ``state`` (8): piston positions y1, y2 and speeds v1, v2, absolute pressures of chambers P1, N1, P2, N2;
    - ``flow`` (4): mass flows into these chambers;
    - ``force`` (4): of the hand on the end effector, x, y, and what else acts along pistons 1, 2, such as -Fc sign(v) of (4);
    - ``rates`` (8): d(state)/dt;
    - ``outputs`` (6): end effector x, y, vx, vy, and pneumatic stiffnesses K1, K2.
    """

    state: Any
    flow: Any
    force: Any
    rates: Any
    outputs: Any


def symbolic_model(parameters: Parameters | str | Path | None = None, algebra: str = "sympy") -> SymbolicModel:
    """The model of a rig, its parameters as numbers; ``algebra`` is ``"sympy"`` or ``"casadi"``, which has to be installed.

    With CasADi, ``casadi.Function("rates", [m.state, m.flow, m.force], [m.rates])`` makes a function of it. Raises
    ``ValueError`` for another algebra.
    """
    try:
        of = import_module(one_of("algebra", algebra, ALGEBRAS))
    except ImportError as error:
        raise ImportError(f"symbolic_model needs {algebra}: pip install {algebra}") from error
    if algebra == "sympy":
        operations = {"sqrt": of.sqrt, "max": of.Max, "min": of.Min}
        symbol, column = of.Symbol, of.Matrix
    else:
        operations = {"sqrt": of.sqrt, "max": of.fmax, "min": of.fmin}
        symbol, column = of.SX.sym, lambda entries: of.vertcat(*entries)
    graph = Graph()
    read = {name: inputs(graph, name, len(words.split())) for name, words in SYMBOLS.items()}
    numbers = Rig(inputs(graph, "p", PARAMETERS)[:, 0])
    rates, outputs = empty(horizon.STATE), empty(horizon.OUTPUTS)
    call(horizon.rates, *read.values(), numbers, rates, 0)
    call(horizon.outputs, read["x"], numbers, outputs, 0)
    given = {name: [symbol(word) for word in words.split()] for name, words in SYMBOLS.items()}
    rig = [float(number) for number in parameter_column(load_parameters(parameters))]
    found = carried_out(graph, {**given, "p": rig}, {**ARITHMETIC, **operations})
    made = (column([found[value.at] for value in block[:, 0]]) for block in (rates, outputs))
    return SymbolicModel(*map(column, given.values()), *made)
