"""The control model of the air (6)-(10), proven with SymPy from the gas law and from total derivatives, not from itself."""

from collections.abc import Callable
from functools import cache
from types import FunctionType

import sympy as sp

from birthsim_env.physics import control_model

PP, PN, QP, QN, SP, SN, LENGTH, K, RT = sp.symbols("Pp Pn qp qn Sp Sn l k rT", positive=True)
Y, V, QA, QT, FORCE, STIFFNESS, RATE = sp.symbols("y v qA qT F K rate", real=True)
LP, LN = LENGTH / 2 + Y, LENGTH / 2 - Y


def formula(helper: Callable[..., float]) -> Callable[..., sp.Expr]:
    """The source of a compiled helper, and of the helpers it calls, as a function of symbols."""
    source = helper.py_func  # type: ignore[attr-defined]
    names = source.__globals__
    called = {name: formula(names[name]) for name in source.__code__.co_names if hasattr(names.get(name), "py_func")}
    return FunctionType(source.__code__, names | called)


def vanishes(expression: sp.Expr) -> bool:
    """Whether an expression is zero for all values; floating constants of the package are made exact first."""
    return bool(sp.cancel(sp.together(sp.nsimplify(expression, rational=True))) == 0)


@cache
def polytropic_rates() -> tuple[sp.Expr, sp.Expr]:
    """dPp/dt and dPn/dt from P proportional to (mass/volume)^k and P V = mass r T, the assumptions behind (6)."""
    t, c = sp.symbols("t c", positive=True)
    mass, position = sp.Function("M")(t), sp.Function("Y")(t)
    rates = []
    for area, length, pressure, flow in ((SP, LENGTH / 2 + position, PP, QP), (SN, LENGTH / 2 - position, PN, QN)):
        volume = area * length
        law = c * (mass / volume) ** K
        now = [(mass.diff(t), flow), (position.diff(t), V), (mass, pressure * volume / RT), (position, Y)]
        rate = law.diff(t).subs(now)
        rates.append(sp.simplify(rate / law.subs(now) * pressure))
    return rates[0], rates[1]


def total_derivative(quantity: sp.Expr) -> sp.Expr:
    """d/dt of a function of Pp, Pn and y along the polytropic chambers."""
    rate_p, rate_n = polytropic_rates()
    return quantity.diff(PP) * rate_p + quantity.diff(PN) * rate_n + quantity.diff(Y) * V


F_OF_PRESSURES = PP * SP - PN * SN
"""(3)."""


@cache
def stiffness_of_pressures() -> sp.Expr:
    """-dF/dy of two closed chambers, each with P V^k constant."""
    step = sp.symbols("step")
    pp, pn = PP * (LP / (LP + step)) ** K, PN * (LN / (LN - step)) ** K
    return sp.simplify(-sp.diff(pp * SP - pn * SN, step).subs(step, 0))


def test_polytropic_rates_6() -> None:
    rate_p, rate_n = polytropic_rates()
    assert vanishes(formula(control_model.polytropic_rate_p)(PP, QP, V, SP, LP, K, RT) - rate_p)
    assert vanishes(formula(control_model.polytropic_rate_n)(PN, QN, V, SN, LN, K, RT) - rate_n)
    # A rod that extends at constant mass lowers Pp and raises Pn.
    closed = {QP: 0, QN: 0, PP: 4e5, PN: 3e5, SP: 5e-4, SN: 4e-4, LENGTH: 0.2, Y: 0.01, K: 1.2, RT: 84000, V: 0.1}
    assert rate_p.subs(closed) < 0 < rate_n.subs(closed)


def test_pneumatic_stiffness_9_is_the_slope_of_closed_chambers() -> None:
    shown = formula(control_model.pneumatic_stiffness)(PP, PN, SP, SN, LP, LN, K)
    assert vanishes(shown - stiffness_of_pressures())


def test_transform_8_and_its_inverse_are_inverses() -> None:
    """(8) as the matrix that the paper prints, inverted by SymPy."""
    matrix = LENGTH / 2 * sp.Matrix([[1 / LP, -1 / LN], [1 / LP, 1 / LN]])
    active, pressurization = matrix * sp.Matrix([QP, QN])
    assert vanishes(formula(control_model.active_flow)(QP, QN, LP, LN) - active)
    assert vanishes(formula(control_model.pressurization_flow)(QP, QN, LP, LN) - pressurization)
    flow_p, flow_n = matrix.inv() * sp.Matrix([QA, QT])
    assert vanishes(formula(control_model.chamber_flow_p)(QA, QT, LP, LN) - flow_p)
    assert vanishes(formula(control_model.chamber_flow_n)(QA, QT, LP, LN) - flow_n)


@cache
def flows() -> tuple[sp.Expr, sp.Expr]:
    """qA and qT of (8) for the flows qp and qn."""
    return LENGTH / 2 * (QP / LP - QN / LN), LENGTH / 2 * (QP / LP + QN / LN)


def test_force_rate_10_is_the_total_derivative_of_3() -> None:
    active, _ = flows()
    stiffness, truth = stiffness_of_pressures(), total_derivative(F_OF_PRESSURES)
    assert vanishes(2 * K * RT / LENGTH * active - stiffness * V - truth), "as the paper prints it"
    assert vanishes(formula(control_model.force_rate)(active, stiffness, V, LENGTH, K, RT) - truth)


def test_stiffness_rate_10_is_the_total_derivative_of_9() -> None:
    active, pressurization = flows()
    stiffness, force = stiffness_of_pressures(), F_OF_PRESSURES
    truth = total_derivative(stiffness)
    a1, a2, b1, b2 = 2 * (K + 1), K * (K + 1), 2 * K**2 * RT / LENGTH, K**2 * RT
    paper = (a1 * V * Y * stiffness - a2 * V * force - b1 * Y * active + b2 * pressurization) / (LP * LN)
    assert vanishes(paper - truth), "as the paper prints it"
    shown = formula(control_model.stiffness_rate)(force, stiffness, V, active, pressurization, LP, LN, K, RT)
    assert vanishes(shown - truth)


def test_flows_for_wanted_rates_invert_10() -> None:
    """Put into the total derivatives of (3) and (9), the flows give exactly the rates they were asked for."""
    stiffness_rate = sp.symbols("dK", real=True)
    stiffness, force = stiffness_of_pressures(), F_OF_PRESSURES
    active = formula(control_model.active_flow_for)(RATE, stiffness, V, LENGTH, K, RT)
    pressurization = formula(control_model.pressurization_flow_for)(stiffness_rate, force, stiffness, V, active, LP, LN, K, RT)
    split = sp.solve([flows()[0] - QA, flows()[1] - QT], [QP, QN], dict=True)[0]
    given = {q: split[q].subs([(QA, active), (QT, pressurization)]) for q in (QP, QN)}
    assert vanishes(total_derivative(force).subs(given) - RATE)
    assert vanishes(total_derivative(stiffness).subs(given) - stiffness_rate)
