"""What the page draws the rig from: the shapes and dimensions of the frames' drawing, so that the two cannot drift apart."""

from __future__ import annotations

import os
from dataclasses import asdict
from typing import Any

from birthsim_env.physics.rig.parameters import Parameters


def shapes(rig: Parameters) -> dict[str, Any]:
    """``bounds`` (xmin, ymin, xmax, ymax, m) of all that is drawn in any pose, the ``barrels`` of cylinders 1 and 2 (m), and
    the fetal ``head``: ``profile`` and ``features`` in units of its ``radius`` (m), first towards the crown, second towards
    the face.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    from birthsim_env.drawing import rig as drawn

    picture = drawn.Rig(rig)
    low, high = picture.extent()
    features = [drawn.EYE, drawn.MOUTH, [*drawn.EAR, drawn.EAR[0]]]
    return {
        "gamma3": rig.geometry.gamma3,
        "bounds": [*map(float, low), *map(float, high)],
        "barrels": [asdict(barrel) for barrel in picture.barrels],
        "head": {"radius": picture.head_radius, "profile": drawn.PROFILE, "features": features},
    }
