"""The single environment: one lane of the simulation."""

from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from birthsim_env.assembly import RENDER_MODES, Arguments, assemble, one_of, spelled_out
from birthsim_env.drawing.scene import Scene
from birthsim_env.episodes import Episodes
from birthsim_env.face import Face, measurement_of
from birthsim_env.info import single_info
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.parts.scenarios import Scenario, environment_id
from birthsim_env.physics.rig.values import whole_of
from birthsim_env.registry import Entry, entries
from birthsim_env.reward import REWARD_TERMS

_ONE = np.ones(1, dtype=np.bool_)


class BirthSIMEnv(Face, gymnasium.Env[NDArray[np.float32], NDArray[Any]]):
    """The haptic part of BirthSIM: two pneumatic cylinders move the end effector, the fetal head, in a vertical plane.

    ## Description
    The policy drives four servovalves. The end effector should follow a target, and give way like a spring to the hand that
    pushes it. So it should stay on the *compliant target* xk = xt + Fx/Kclx, yk = yt + Fy/Kcly (19), where Kclx and Kcly are
    the stiffness asked for. The plant is that of Herzig et al. (IROS 2015) with temperature, dead volume, leakage, spool lag
    and LuGre friction. It is integrated by Runge-Kutta steps of 1/3 ms.

    | id | experiment | s |
    |---|---|---|
    {scenarios}

    ## Action space
    `Box(-1, 1, (n,), float32)`, held for one policy period (10 ms):

    | `action_mode` | `valves` | entries |
    |---|---|---|
    | `"valve"` | `"two_valves"` | spool openings of chambers P1, N1, P2, N2; 1 fills from the supply, -1 empties (5 V +- 5 V) |
    | `"valve"` | `"one_valve"` | openings of one 5/3 valve per cylinder; chamber N gets the opposite of chamber P |
    | `"flow"` | `"two_valves"` | net mass flows into P1, N1, P2, N2, in units of the choked flow (3.2 g/s) |
    | `"flow"` | `"one_valve"` | active mass flows qA (8) of cylinders 1 and 2, in the same unit |

    ## Observation space
    `Box(-10, 10, (20 + n,), float32)`, roughly [-1, 1], from what the sensors say; `observation_names` lists this table:

    | index | entry | value that maps to 1 |
    |---|---|---|
    | 0, 1 | tracking error x, y: end effector minus compliant target | 0.01 m |
    | 2, 3 | end effector velocity x, y | 0.2 m/s |
    | 4, 5 | piston positions y1, y2 | half a stroke |
    | 6, 7 | forces on pistons 1, 2: F - Fext + user force along the cylinder (17) | 200 N |
    | 8, 9 | pneumatic stiffness (9) of cylinders 1, 2 | 5000, 2500 N/m |
    | 10, 11 | its setpoints | 5000, 2500 N/m |
    | 12, 13 | closed-loop stiffness setpoints Kclx, Kcly | 5000 N/m |
    | 14, 15 | user force x, y | 50 N |
    | 16, 17 | target velocity x, y | 0.2 m/s |
    | 18, 19 | target acceleration x, y | 0.5 m/s2 |
    | 20 ... | last action | 1 |

    ## Reward
    Between 0 and 1 per 10 ms, so that ending early never pays, whatever the discount. It is the sum of five terms, which are
    also in `info`. `reward_survive` is 1. The other four cost a fraction of c = 8.75:

    - `reward_tracking` = -ln(1 + (|ex| + |ey|) / 1 mm)/c
    - `reward_hunting` = -0.2 ln(1 + (|wx| + |wy|) / 10 mm/s)/c
    - `reward_effort` = -0.04 mean(a^2)/c
    - `reward_action_change` = -0.2 mean(|a - last a|)/c

    Here e and w are position and speed relative to the compliant target, and a is the action. After a jump of the force or of
    a stiffness setpoint the compliant target moves with a time constant of 60 ms. An episode that terminates pays nothing more.

    ## Start and end of an episode
    The end effector starts on the target and moves with it. The chambers balance weight and friction at the pneumatic
    stiffness asked for. `reset(options={"position": (x, y)})` starts the end effector there instead, at rest.
    The episode terminates when the state leaves the physical range: a piston runs into an end stop faster than
    `parameters.mechanics.impact_speed` (0.1 m/s), or a chamber leaves 0.2 to 20 bar or 100 to 1000 K. It is truncated at the
    scenario's end.

    ## Info
    The true state in SI units, whatever the sensors: the fields of `birthsim_env.info.FIELDS`, as NumPy numbers and arrays. The
    reward terms, which are zero after `reset`. `cost` is 1 where a constraint is violated, which `stop_depth` and
    `pressure_excess` name, as in Safety-Gymnasium; the episode goes on. `is_success`: whether the settled error has been below
    1 mm so far and the episode has not terminated. The settled error is the root mean square distance from the compliant
    target, from 0.5 s after a jump on.

    ## Arguments
    - `action_mode`, `valves`: see above.
    - `sensors`: the sensor model, whose figures are those of `birthsim_env.physics.electronics`:
      {sensors}
    - `force_sensor`: `False` for a rig without one. The measured force of the hand is then zero, and every entry of the
      observation is computed with that.
    - `randomize`: what every episode draws anew. `False`: nothing. `"plant"`: the rig, from ranges about the one described
      (`birthsim_env.parts.drawn.randomization`). `"scenario"`: the experiment. `True`: both. `"sensors"`: the experiment, and
      the parameters of realistic sensors (`honest`) alone. A mapping such as `{"mechanics.mass": (2, 5)}` draws just these
      parameters. `env.unwrapped.set_ranges` changes it for the episodes to come.
    - `reference`: your own instead of the scenario's: a `Trajectory`, a function of time (s) that returns (x, y) in m, a
      CSV file of time, x, y, or `"file.py:Name"`.
    - `user_force`: the hand, instead of the scenario's. A `UserForce`; a function of time, or of time, position and velocity,
      that returns (Fx, Fy) in N; a CSV file of time, Fx, Fy; or `"file.py:Name"`. Or the name of a hand:
      {hands}
    - `stiffness`: a number (N/m), a `StiffnessSchedule` of your own, or a CSV file of time, x, y, stiffness (N/m), which
      `reference` takes too. A CSV file's heading names its columns; `"file.csv:t,a,b"` says how others are called. Times are
      s since the episode begins. Between its rows a reference is smooth and stays between them, a force is linear.
    - `parameters`: a `Parameters`, the path of a TOML file that describes your rig, or what such a file holds:
      `{"mechanics": {"mass": 4.0}}`.
    - `policy_period` in s, a multiple of the control period of 1 ms up to 1 s; `duration` in s, rounded to whole policy steps.
    - `clip_actions`: `True` clips actions beyond [-1, 1] instead of refusing them.
    - `num_threads`: how many threads share the lanes of a vector environment. The number changes no bit. Default: one in a
      single environment, else all processors, at most `OMP_NUM_THREADS`.
    - `actuation`: an object of your own between action and valves (`birthsim_env.parts.actuation.Actuation`) instead of a mode.
    - `render_mode`: `None`, `"rgb_array"` or `"human"`, in real time; `picture_size`: (width, height) in px, (640, 480).
      `gymnasium.wrappers.RecordVideo` needs the extra `video`; its videos play in real time too.

    Controllers read `env.unwrapped.measurement` and `env.unwrapped.reference`, one rig's `Measurement` and `Reference`.

    ## Errors
    `TypeError` for arguments that there are not. `ValueError` naming the argument, its value and what is allowed: modes,
    parameters, ranges, references that leave the workspace, times that miss the episode, actions that are not finite numbers
    in [-1, 1] of the right shape.

    ## Version history
    - Circle, Descent, Forceps, Dystocia v2, Probe v3, Vacuum v1: the catalogue's valves, friction that grows with pressure,
      bristles of any stiffness; other worlds are drawn. The ids before are refused.
    - Probe v2: the push begins after 3 s instead of 1 s, when the head is at rest, and the episode lasts 7 s instead of 5 s.
    - v1: the reward is never negative; a circle starts without preloaded friction.
    - v0: first version.
    """

    @spelled_out()
    def __init__(self, scenario: str, render_mode: str | None = None, **arguments: Unpack[Arguments]) -> None:
        self.render_mode = one_of("render_mode", render_mode, (None, *RENDER_MODES))
        setup = assemble(1, scenario, **arguments)
        self.observation_space: spaces.Space[Any] = setup.single_observation_space
        self.action_space: spaces.Space[Any] = setup.single_action_space
        self._show(Episodes(setup))

    @property
    def measurement(self) -> Measurement:
        """What the sensors say now: the input of a controller. Arrays without a lane axis."""
        return measurement_of(self.simulation.measurement, 0)

    @property
    def reference(self) -> Reference:
        """What is asked for now: the other input of a controller."""
        return Reference(self.simulation.reference.rows[:, 0])

    @property
    def scene(self) -> Scene:
        """What a frame shows now, in any render mode; see ``birthsim_env.drawing.scene.Scene``."""
        return self.scene_of(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; a seed makes this and all following episodes repeatable."""
        whole = whole_of(seed)
        seed = seed if whole is None else whole
        super().reset(seed=seed)
        self._episodes.seed(seed, self.np_random)
        self._episodes.begin(_ONE, options)
        self._render_human()
        terms = dict.fromkeys(REWARD_TERMS, np.float64(0.0))
        info = {**single_info(self._episodes.describe()), **terms, "is_success": False}
        return self._episodes.observation()[0], info

    def step(self, action: NDArray[Any]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One policy step."""
        episodes = self._episodes
        reward_terms, (terminated,) = episodes.step(episodes.columns([action]))
        truncated = not terminated and bool(episodes.elapsed[0] >= self.steps)
        info: dict[str, Any] = single_info(episodes.describe())
        info.update(zip(REWARD_TERMS, reward_terms[:-1, 0], strict=True))
        info["is_success"] = bool(episodes.success[0])
        self._render_human()
        return episodes.observation()[0], float(reward_terms[-1, 0]), bool(terminated), truncated, info

    def render(self) -> Any:
        """A frame (height, width, 3), uint8, in mode ``rgb_array``."""
        if self.render_mode != "rgb_array":
            return None
        frames = self._episodes.render("rgb_array", 1)
        return frames[0] if frames else None

    def _render_human(self) -> None:
        if self.render_mode == "human":
            self._episodes.render("human", 1)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._episodes.close()


def _row_of(scenario: Entry) -> str:
    """A scenario's row in the table of ids."""
    made: Scenario = scenario.made()
    return f"| `{environment_id(scenario.name)}` | {made.experiment} | {made.duration:g} |"


def _said_of(choice: Entry) -> str:
    """A line of the choices of an argument."""
    return f'- `"{choice.name}"`: {choice.about}'


def _with_lists(docstring: str) -> str:
    """A docstring with what is registered in the places that are named for it, in braces."""
    for place, kind, line in (
        ("scenarios", "scenario", _row_of),
        ("sensors", "sensors", _said_of),
        ("hands", "hand", _said_of),
    ):
        before, _, after = docstring.partition(f"{{{place}}}")
        indent = before.rpartition("\n")[2]
        docstring = before + f"\n{indent}".join(map(line, entries(kind))) + after
    return docstring


if BirthSIMEnv.__doc__:  # Python may run without
    BirthSIMEnv.__doc__ = _with_lists(BirthSIMEnv.__doc__)
