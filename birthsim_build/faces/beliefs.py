"""What a program in C tells a controller of its rig while it runs, where that controller has the option ``own_beliefs``."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from baselines.admittance import law
from baselines.admittance.belief import Belief
from baselines.admittance.rows import Constants
from birthsim_build.bundle import Bundle
from birthsim_build.derived_parameters import derived_parameters, parameter_names
from birthsim_build.image import ENTRY, HEAD, PART_HEAD, Words, name_of
from birthsim_env.physics.compiled.lanes import PARAMETERS
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of

TEMPLATE = Path(__file__).resolve().parent / "believe.h"
BELIEVES = name_of(law.control_each)
"""The function of the stage that has beliefs."""


def belief_in(image: Words, functions: Sequence[str]) -> int | None:
    """The word of an image at which ``Belief`` of its law begins; None where it has none or finds its rig by itself."""
    place = HEAD + int(image[3])
    for _ in range(image[2]):
        part = image[place:]
        for function, memory, constants, _ in part[PART_HEAD : PART_HEAD + ENTRY * part[1]].reshape(-1, ENTRY).tolist():
            if functions[function] == BELIEVES:
                own = Constants(part[constants : constants + Constants.size].view(np.float64))
                if own.rows_of_finder == 0.0:
                    return place + memory + int(own.rows_of_memory)
        place += int(part[0])
    return None


def beliefs(bundle: Bundle, images: Mapping[str, Words]) -> str:
    """The part of the header that tells beliefs; empty where no controller of the bundle takes any."""
    found = {name: belief_in(words, bundle.functions) for name, words in images.items()}
    places = [f"#define BIRTHSIM_{name.upper()}_BELIEF {place}" for name, place in found.items() if place is not None]
    return _text(places, bundle.rig) if places else ""


def _text(places: Sequence[str], rig: Parameters) -> str:
    names, text = parameter_names(rig), TEMPLATE.read_text()
    rows = [
        f"  BIRTHSIM_RIG_{name.replace('.', '_').upper()} = {k}, /* {DECLARED[name].about}, {DECLARED[name].unit} */"
        for k, name in enumerate(names)
    ]
    for mark, value in (
        ("PARAMETERS", "\n".join(rows)),
        ("COUNT", str(len(names))),
        ("PLACES", "\n".join(places)),
        ("OWN", ", ".join(float(value_of(rig, name)).hex() for name in names)),
        ("TOLD", ",\n".join(f"    {term}" for term in derived_parameters(rig))),
        ("RIG", str(PARAMETERS)),
        ("NEWS", str(Belief.news.first)),
    ):
        text = text.replace(f"@{mark}@", value)
    return text
