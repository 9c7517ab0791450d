"""The scenarios with the law inside: a policy adds a residual."""

from typing import Any

from agents.residual.corrected import ResidualActuation
from agents.residual.settings import ResidualSettings
from birthsim_env.assembly import refuse_unknown
from birthsim_env.env import BirthSIMEnv
from birthsim_env.parts.scenarios import rig_of
from birthsim_env.vector_env import BirthSIMVectorEnv


class _InnerController:
    """Puts the law between the policy and the valves of the environment that it is mixed into."""

    def __init__(self, scenario: str, **arguments: Any) -> None:
        inside = ("action_mode", "valves", "actuation")
        for name in inside:
            if name in arguments:
                raise ValueError(f"{name} = {arguments[name]!r}; allowed: not given, the law drives one valve per chamber")
        own = ("law", "impedance", "authority", "time_constant", "informed")
        refuse_unknown(arguments, (*own, "num_envs", "max_episode_steps", "autoreset_mode", "device"), inside)
        rig = rig_of(scenario, arguments.pop("parameters", None))
        shared = {name: arguments[name] for name in ("policy_period", "force_sensor") if name in arguments}
        settings = ResidualSettings(**shared, **{name: arguments.pop(name) for name in own if name in arguments})
        super().__init__(scenario, parameters=rig, actuation=ResidualActuation(rig, settings), **arguments)  # type: ignore[call-arg]


class ResidualEnv(_InnerController, BirthSIMEnv):
    """A scenario of ``BirthSIMEnv`` with a control law running inside at 1 kHz, which a policy corrects.

    ## Action space
    `Box(-1, 1, (n,), float32)`, held for one policy period and smoothed by a low-pass (`time_constant` = 28 ms). With zero
    actions the environment behaves exactly as the law alone. n and the entries depend on `impedance`:

    | `impedance` | entries |
    |---|---|
    | `"fixed"` | a force along cylinders 1 and 2, in units of `authority` (100 N), that the law believes in |
    | `"variable_kp"` | and an exponent of 4 for the stiffness Kclx, Kcly that the law works with; less than zero is zero |
    | `"variable"` | and an exponent of 2 for the damping; less than zero is zero |

    On a rail each pair is one entry: a force on the only cylinder, and the stiffness along the rail.

    However stiffly the law works, its target moves so that a hand at rest feels the stiffness that is asked for. Except with
    `"fixed"`, the law works less stiffly for a while where pistons swing faster than 0.25 m/s, whatever the action
    (`agents.residual.authority`).
    With `law` = `"none"` there is no law: n = 4, the spool openings of chambers P1, N1, P2, N2, not smoothed.

    ## Observation space
    That of `BirthSIMEnv`. After the last action follow three more groups. First the smoothed action. Then the fractions of the
    authority that are left; they fall where pistons oscillate. Last the forces on pistons 1 and 2 that the model does not
    explain, in units of 100 N: now, when the piston last moved out, and when it last moved in. An `informed` policy also sees
    what the admittance controller would know (`agents.residual.features`). `observation_names` lists all.

    ## Reward, start, end and info
    Those of `BirthSIMEnv`.

    ## Arguments
    Those of `BirthSIMEnv` without `action_mode`, `valves` and `actuation`, and `law` (one of `agents.residual.settings.LAWS`),
    `impedance`, `authority` (N), `time_constant` (s) and `informed`. Without a `force_sensor` neither the law nor the policy
    gets the hand's force. It is then a part of the unexplained forces.

    ## Version history
    - v2 and v3: as `BirthSIMEnv`.
    - v1: as `BirthSIMEnv` v1.
    - v0: first version.
    """


class ResidualVectorEnv(_InnerController, BirthSIMVectorEnv):
    """``ResidualEnv`` over N lanes in one kernel call per control period; see ``BirthSIMVectorEnv``."""
