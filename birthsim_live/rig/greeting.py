"""What a page must know of a rig before it moves: what can be set, what it looks like, and what is said of all that.

The page's worker refuses what is not among the settings.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from birthsim_build.layout import DRAG_LIMIT
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.scenarios import scenarios_for
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import RAIL, TWO_CYLINDERS
from birthsim_env.registry import names
from birthsim_live.rig.words import CHOICES, described, words

NOTHING = "nothing"
"""What a rig is compared with where no second one is beside it."""

OPENS = "backstepping"
"""The controller that a visitor of the page meets: the paper's control law, whose error under a pull can be seen."""


OPENS_WITH = {TWO_CYLINDERS: "probe", RAIL: "rail-stiffness"}
"""Word of ``linkage.kind`` -> the scenario that a visitor meets, whose target rests: what moves is the visitor's doing."""


@dataclass(frozen=True)
class Slider:
    """A number that can be set: what it is called, its unit, from where to where, and where it stands at first."""

    label: str
    symbol: str
    unit: str
    min: float
    max: float
    default: float
    log: bool = False


def sliders(rig: Parameters) -> dict[str, Slider]:
    """Name -> slider for a rig. All ranges are assumed: what the rig bears, and a little of what it does not."""
    mass = rig.mechanics.mass
    along = "the rail" if rig.linkage.is_rail else "x"
    return {
        "Kclx": Slider(f"Closed-loop stiffness along {along}", "Kclx", "N/m", 200.0, 8000.0, 2000.0, log=True),
        "Kcly": Slider("Closed-loop stiffness along y", "Kcly", "N/m", 200.0, 8000.0, 2000.0, log=True),
        "Kpneu1": Slider("Pneumatic stiffness of cylinder 1", "K1", "N/m", 2000.0, 6000.0, 4600.0, log=True),
        "Kpneu2": Slider("Pneumatic stiffness of cylinder 2", "K2", "N/m", 1000.0, 3000.0, 2300.0, log=True),
        "damping": Slider("Damping, times the controller's own", "B", "1", 1.0, 2.0, 1.0),
        "mass": Slider("Mass that moves; the controller believes the rig's", "m", "kg", min(1.5, mass), max(6.0, mass), mass),
        "friction": Slider("Friction, times the rig's; the controller believes 1", "Ff", "1", 0.0, 2.0, 1.0),
        "drag_stiffness": Slider("Spring between end effector and pointer", "Kdrag", "N/m", 100.0, 3000.0, 1000.0, log=True),
    }


def default_settings(rig: Parameters) -> dict[str, Any]:
    """A target at rest and nobody but the person who pushes: displacement is force over stiffness.

    ``compare`` is the controller of a second rig beside the first; ``scenario_force`` keeps or drops the scenario's own hand;
    ``stiffness_source`` says whether the setpoints are the scenario's or the sliders'.
    """
    words = {
        "scenario": OPENS_WITH[rig.linkage.kind], "controller": OPENS, "compare": NOTHING, "valves": "two_valves",
        "sensors": "ideal", "scenario_force": False, "stiffness_source": "scenario",
    }  # fmt: skip
    return {**words, **{name: slider.default for name, slider in sliders(rig).items()}}


def greeting(rig: Parameters, controllers: Sequence[dict[str, str]]) -> dict[str, Any]:
    """It, with the choices of ``controllers``. ``cylinders`` are those that move, counted from 0; a rail's ``guide`` is the
    direction along which alone a hand's force acts, and None elsewhere."""
    g, air = rig.geometry, rig.air
    named = {"scenario": scenarios_for(rig), "valves": VALVE_LAYOUTS, "sensors": names("sensors")}
    return {
        "choices": {
            "controller": controllers,
            "compare": [{"name": NOTHING, "title": NOTHING, "about": "One rig alone."}, *controllers],
            **{name: described(choices, CHOICES[name]) for name, choices in named.items()},
        },
        "defaults": default_settings(rig),
        "ranges": {name: asdict(slider) for name, slider in sliders(rig).items()},
        "geometry": {
            "pivot1": [g.d3 * math.cos(g.gamma3), g.d3 * math.sin(g.gamma3)],
            "pivot2": [0.0, 0.0],
            **{name: getattr(g, name) for name in ("d3", "d6", "k1", "k2", "gamma3")},
            "half_stroke1": rig.cylinder1.stroke / 2,
            "half_stroke2": rig.cylinder2.stroke / 2,
            **shapes(rig),
        },
        "cylinders": list(rig.linkage.topology.cylinders),
        "guide": [math.cos(rig.linkage.inclination), math.sin(rig.linkage.inclination)] if rig.linkage.is_rail else None,
        "air": {"supply": air.supply_pressure, "atmosphere": air.atmospheric_pressure},
        "areas": [area for one in (rig.cylinder1, rig.cylinder2) for area in (one.area_p, one.area_n)],
        "drag_limit": DRAG_LIMIT,
        "words": words(),
    }


def shapes(rig: Parameters) -> dict[str, Any]:
    """Shapes and dimensions of the frames' drawing, so that the two cannot drift apart.

    The outline of the ``workspace`` (x, y, m), ``bounds`` (xmin, ymin, xmax, ymax, m) of all that is drawn in any pose, the
    ``barrels`` of cylinders 1 and 2 (m), and the fetal ``head``: ``profile`` and ``features`` in units of its ``radius`` (m),
    first towards the crown, second towards the face.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    from birthsim_env.drawing import rig as drawn

    picture = drawn.Rig(rig)
    low, high = picture.extent()
    features = [drawn.EYE, drawn.MOUTH, [*drawn.EAR, drawn.EAR[0]]]
    return {
        "workspace": [[round(x, 6), round(y, 6)] for x, y in picture.workspace()],
        "bounds": [*map(float, low), *map(float, high)],
        "barrels": [asdict(barrel) for barrel in picture.barrels],
        "head": {"radius": picture.head_radius, "profile": drawn.PROFILE, "features": features},
    }
