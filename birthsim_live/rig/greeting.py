"""What a page must know of a rig before it moves: what can be set, what it looks like, and what is said of all that."""

import math
import os
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from birthsim_build.layout import DRAG_LIMIT
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.settings import NOTHING, default_settings, sliders
from birthsim_live.rig.words import CHOICES, described, words


def greeting(rig: Parameters, controllers: Sequence[dict[str, str]]) -> dict[str, Any]:
    """It, with the choices of ``controllers``."""
    g, air = rig.geometry, rig.air
    named = {"scenario": SCENARIOS, "valves": VALVE_LAYOUTS, "sensors": SENSORS}
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
