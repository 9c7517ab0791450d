"""Which rigs a lane may be told."""

from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from birthsim_env.physics.rig.rows import plant_parameters


def require_believable(rig: Parameters, own: Parameters) -> None:
    """Raise ``ValueError`` where ``rig`` differs from a controller's ``own`` in more than numbers that plants compute with."""
    for name in DECLARED:
        its, mine = value_of(rig, name), value_of(own, name)
        if its != mine and (name not in plant_parameters() or DECLARED[name].option or DECLARED[name].choices):
            raise ValueError(f"rig: {name} = {its!r}; allowed: {mine!r}, as the controller was made with")
