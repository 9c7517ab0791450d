"""``modelDescription.xml`` of FMI 2.0 and 3.0: what a tool reads of a model before it loads it."""

import math
import re
from collections import Counter
from dataclasses import dataclass
from xml.etree import ElementTree

from birthsim_env import __version__


@dataclass(frozen=True)
class Variable:
    """A number of the model. ``causality`` is "independent" (the time), "parameter", "input" or "output"; SI units.

    An input ``is_sample`` where it may be anything, also not finite: the model itself looks after it.
    """

    name: str
    causality: str
    unit: str
    description: str
    start: float = 0.0
    least: float = -math.inf
    most: float = math.inf
    is_sample: bool = False


@dataclass(frozen=True)
class Description:
    """A model: ``identifier`` names its binary, ``token`` ties that to this description, ``period`` is its step, s.

    ``variables`` stand in the order of their value references; the first is the time.
    """

    identifier: str
    name: str
    about: str
    token: str
    period: float
    variables: tuple[Variable, ...]


_VARIABILITY = {"independent": "continuous", "parameter": "fixed", "input": "continuous", "output": "continuous"}


_BASE = {"kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "K": {"K": 1}, "rad": {"rad": 1}}
_DERIVED = {
    "N": {"kg": 1, "m": 1, "s": -2}, "Pa": {"kg": 1, "m": -1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3}, "Hz": {"s": -1},
}  # fmt: skip
_SYMBOL = re.compile(r"([A-Za-z]+)(\d*)")


def model_description(model: Description, version: int) -> bytes:
    """The XML file of a model for version 2 or 3 of the standard."""
    three = version == 3
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0" if three else "2.0",
        modelName=model.name,
        description=model.about,
        generationTool=f"birthsim export {__version__}",
        variableNamingConvention="structured",
        license="MIT",
    )
    root.set("instantiationToken" if three else "guid", model.token)
    capabilities = {
        "modelIdentifier": model.identifier, "canHandleVariableCommunicationStepSize": "true",
        f"canGetAndSetFMU{'S' if three else 's'}tate": "true", f"canSerializeFMU{'S' if three else 's'}tate": "true",
    }  # fmt: skip
    if three:
        capabilities["fixedInternalStepSize"] = repr(model.period)
    ElementTree.SubElement(root, "CoSimulation", capabilities)
    _units(root, model)
    categories = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(categories, "Category", name="logStatusError", description="what was refused, and why")
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=repr(model.period))
    variables = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(model.variables):
        _variable(variables, reference, variable, three)
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [k for k, variable in enumerate(model.variables) if variable.causality == "output"]
    if three:
        for kind in ("Output", "InitialUnknown"):
            for k in outputs:
                ElementTree.SubElement(structure, kind, valueReference=str(k))
    else:
        for kind in ("Outputs", "InitialUnknowns"):
            listed = ElementTree.SubElement(structure, kind)
            for k in outputs:
                ElementTree.SubElement(listed, "Unknown", index=str(k + 1))
    ElementTree.indent(root)
    content: bytes = ElementTree.tostring(root, "utf-8", xml_declaration=True)
    return content


def exponents(unit: str) -> dict[str, int]:
    """``"W/(m2 K)"`` -> ``{"kg": 1, "s": -3, "K": -1}``; ``"-"`` and ``"1"`` have none. ``ValueError`` for unknown symbols."""
    total: Counter[str] = Counter()
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below, -1)):
        for symbol in part.strip("()").split():
            found = _SYMBOL.fullmatch(symbol)
            if found and found[1] in _BASE | _DERIVED:
                for base, power in (_BASE | _DERIVED)[found[1]].items():
                    total[base] += sign * power * int(found[2] or 1)
            elif symbol not in ("1", "-"):
                raise ValueError(f"unit = {unit!r}; allowed: products and one quotient of {', '.join(_BASE | _DERIVED)}")
    return {base: power for base, power in total.items() if power}


def _units(root: ElementTree.Element, model: Description) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in sorted({variable.unit for variable in model.variables} - {"1", "-"}):
        one = ElementTree.SubElement(definitions, "Unit", name=unit)
        ElementTree.SubElement(one, "BaseUnit", {base: str(power) for base, power in exponents(unit).items()})


def _variable(parent: ElementTree.Element, reference: int, variable: Variable, three: bool) -> None:
    about = {
        "name": variable.name, "valueReference": str(reference), "causality": variable.causality,
        "variability": _VARIABILITY[variable.causality], "description": variable.description,
    }  # fmt: skip
    number = {} if variable.unit in ("1", "-") else {"unit": variable.unit}
    number |= {"min": repr(variable.least)} if math.isfinite(variable.least) else {}
    number |= {"max": repr(variable.most)} if math.isfinite(variable.most) else {}
    if variable.causality in ("parameter", "input"):
        number["start"] = repr(variable.start)
    if three:
        ElementTree.SubElement(parent, "Float64", about | number)
    else:
        ElementTree.SubElement(ElementTree.SubElement(parent, "ScalarVariable", about), "Real", number)
