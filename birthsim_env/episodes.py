"""What the single and the vector environment share: episodes of lanes, their seeds, rewards, observations and frames."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from birthsim_env.assembly import Arguments, Setup, assemble, checked_actions
from birthsim_env.drawing.scene import Scene
from birthsim_env.loop.pipeline import Pipeline
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.outcome import Outcome
from birthsim_env.parts.drawn.seeding import lane_seeds
from birthsim_env.physics.compiled.lanes import PRESSURES, Y1, Y2, Array
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register
from birthsim_env.restored import Declared, Kept
from birthsim_env.state import State, give_state, plain_value, take_state

if TYPE_CHECKING:
    from birthsim_env.drawing.rendering import Renderer
    from birthsim_env.gradients.recorder import Recorder

WINDOW_FRAMES_PER_SECOND = 50
PATH_POINTS = 160

COUNTED = Kept(least=0, most=2**62, whole=True)
"""Steps and episodes."""


class Episodes:
    """The lanes of a ``Setup`` with their clocks and seeds; ``elapsed`` (N,) counts policy steps since an episode began."""

    arrays: Any = np
    """The module of the arrays of lanes."""

    in_state: ClassVar[Declared] = {
        "elapsed": COUNTED,
        "_numbers": COUNTED,
        "_seeds": Kept(least=0, whole=True),
        "_complete": None,
    }

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self.simulation = setup.simulation
        self.action_size = setup.actuation.size
        lanes = setup.simulation.plant.num_envs
        self.elapsed: NDArray[np.int64] = np.zeros(lanes, dtype=np.int64)
        self._numbers: NDArray[np.int64] = np.full(lanes, -1, dtype=np.int64)
        self._seeds: list[int] = []
        self._asked: Any = None
        """What ``set_ranges`` was given last; None for what the environment was made with."""
        self._complete = True
        """Whether the parts have room for what they draw, and the lanes began in it."""
        self._outcome = Outcome(
            lanes,
            self.simulation.nominal,
            self.action_size,
            len(setup.actuation.memory_names),
            setup.policy_period,
            self.simulation.period,
            self.simulation.parameters.mechanics.impact_speed,
        )
        self.simulation.outcome = self._outcome
        self._renderer: Renderer | None = None
        self._path: Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Without the renderer, whose surfaces belong to this process, and the path, which is drawn: made when asked for."""
        return {**self.__dict__, "_renderer": None, "_path": None}

    @property
    def setup(self) -> Setup:
        """What the episodes are made of."""
        return self._setup

    @property
    def pipeline(self) -> Pipeline:
        """The steps of a control period; another pipeline may be assigned, see ``birthsim_env.loop.pipeline``."""
        return self.simulation.pipeline

    @pipeline.setter
    def pipeline(self, pipeline: Pipeline) -> None:
        self.simulation.pipeline = pipeline

    @property
    def begun(self) -> bool:
        """Whether episodes have begun, which makes room for what parts remember."""
        return bool(self._seeds)

    def set_ranges(self, randomize: Any) -> None:
        """Draw new episodes as if the environment had been made with this ``randomize``; see ``Face.set_ranges``."""
        ranges, _ = self._setup.experiment.drawn(randomize)
        self._draw(ranges if isinstance(randomize, Mapping) else randomize)

    def _draw(self, asked: Any) -> None:
        experiment = self._setup.experiment
        before, now = (experiment.drawn(experiment.randomize if one is None else one) for one in (self._asked, asked))
        parts = experiment.parts(now[1], changing=True) if now[1] != before[1] else {}
        self._complete = self.simulation.draw(now[0], parts) and self._complete
        self._asked, self._path = asked, None

    def _draw_of_state(self, asked: Any) -> None:
        try:
            self._draw(asked)
        except ValueError as error:
            raise ValueError(f"state draws what this environment cannot: {error}") from error

    def _require_begun(self, call: str) -> None:
        """Raise ``RuntimeError`` where lanes must begin before this ``call``."""
        if not self.begun:
            raise RuntimeError(f"{call} before reset(): call reset(seed=...) first")
        if not self._complete:
            raise RuntimeError(
                f"{call} after set_ranges(), which changed more than what is drawn: call reset() of all lanes first"
            )

    def get_state(self, random: np.random.Generator, ended: NDArray[np.bool_] | None = None) -> State:
        """All that the future depends on, with what the environment keeps besides: its generator, and which lanes ended."""
        self._require_begun("get_state()")
        return take_state(self._parts(random, ended))

    def set_state(self, state: State, random: np.random.Generator, ended: NDArray[np.bool_] | None = None) -> None:
        """Go on from what ``get_state`` returned, with the ranges of then; episodes must have begun."""
        before, asked = (self._asked, self._complete), plain_value(state, "episodes._asked")
        own = take_state(self._parts(random, ended)) if asked != self._asked else {}
        try:
            if own:
                self._draw_of_state(asked)
            give_state(self._parts(random, ended), state)
        except ValueError:
            if own:
                self._draw(before[0])
                give_state(self._parts(random, ended), own)
                self._complete = before[1]
            raise
        self._complete = True
        self.simulation.forget_loops()
        self._path = None

    def end(self) -> None:
        """As if no episode had begun."""
        self._seeds = []

    def _parts(self, random: np.random.Generator, ended: NDArray[np.bool_] | None) -> dict[str, Any]:
        return {"episodes": self, "random": random, **({} if ended is None else {"ended": ended})}

    @property
    def duration(self) -> float:
        """Of an episode that nothing ends early, s."""
        return self._setup.duration

    def seed(self, seed: int | list[int | None] | None, generator: np.random.Generator) -> None:
        """Give the lanes new seeds; without any, lanes that have seeds go on with the next episode of theirs."""
        if seed is not None or not self._seeds:
            self._seeds = lane_seeds(seed, len(self.elapsed), generator)
            self._numbers[:] = -1

    def begin(self, lanes: Mask, options: dict[str, Any] | None = None, again: bool = False) -> None:
        """Start the next episode in the lanes of a mask (N,), or the present one ``again``."""
        position = start_of(options)
        if not self._complete and not np.all(lanes):
            self._require_begun("reset() of some lanes")
        self._complete = True
        if not again:
            self._numbers[lanes] += 1
        self.elapsed[lanes] = 0
        self.forget(lanes)
        self.simulation.begin(lanes, self._seeds, self._numbers, self._setup.duration, position)
        self._path = None

    def begin_first(self, seeds: list[int], numbers: NDArray[np.int64], position: Array | None = None) -> None:
        """Put the episodes of these ``numbers`` of lanes with these ``seeds`` into the first lanes, whatever was there."""
        count, missing = self.simulation.plant.num_envs, self.simulation.plant.num_envs - len(seeds)
        first = np.arange(count) < len(seeds)
        self.forget(first)
        episodes = np.concatenate([numbers, np.zeros(missing, dtype=np.int64)])
        self.simulation.begin(first, seeds + [0] * missing, episodes, self._setup.duration, position)

    def forget(self, lanes: Mask) -> None:
        """What closes a policy step forgets the past of the lanes of a mask (N,)."""
        self._outcome.begin(lanes)

    def record(self) -> "Recorder":
        """What keeps every policy step from now on, for gradients."""
        from birthsim_env.gradients.recorder import Recorder  # late: it generates code

        return Recorder(self.simulation)

    def columns(self, actions: Any) -> Array:
        """Actions (N, size) as columns; ``ValueError`` for what they must not be."""
        columns: Array = checked_actions(actions, len(self.elapsed), self.action_size, self._setup.clip_actions)
        return columns

    def local(self, array: Any) -> NDArray[Any]:
        """An array of lanes as one of NumPy's."""
        return np.asarray(array)

    def step(self, actions: Array) -> tuple[Array, NDArray[np.bool_]]:
        """One policy step; returns terms of the reward and the reward, (6, N), and which lanes have left the physical range."""
        if not (self._seeds and self._complete):
            self._require_begun("step()")
        self.simulation.step(actions)
        self.elapsed += 1
        return self._outcome.terms.copy(), self._outcome.ends[0] > 0.0

    @property
    def measurement(self) -> Measurement:
        """What the sensors say now."""
        return self.simulation.measurement

    @property
    def reference(self) -> Reference:
        """What is asked for now."""
        return self.simulation.reference

    @property
    def plant_state(self) -> Array:
        """State of the plant, (18, N)."""
        return self.simulation.plant.state

    @property
    def success(self) -> NDArray[np.bool_]:
        """Whether the episodes are successful so far, (N,): see ``birthsim_env.reward``."""
        return np.asarray(self._outcome.ends[1] > 0.0)

    def outcome_rows(self) -> list[tuple[Array, list[str]]]:
        """Arrays (rows, N) of what a policy step pays, how episodes are doing, and info, with the names of their rows."""
        return self._outcome.named()

    def observation(self) -> NDArray[np.float32]:
        """Observations of all lanes now, (N, size)."""
        return self._outcome.seen.copy()

    def describe(self) -> Array:
        """The fields of ``info`` of all lanes now."""
        return self._outcome.rows.copy()

    def render(self, mode: str, lanes: int) -> tuple[Any, ...] | None:
        """Frames (H, W, 3) of the first ``lanes`` lanes, or None once the first is shown in a window."""
        # Rendering needs pygame, which those who only compute need not load.
        from birthsim_env.drawing.rendering import Renderer

        if self._renderer is None:
            self._renderer = Renderer(self.simulation.parameters, *self._setup.picture_size)
        if mode == "human":
            # Real time, at no more frames than a screen shows: steps between them are left out.
            every = max(1, round(self._setup.frames_per_second / WINDOW_FRAMES_PER_SECOND))
            if self.elapsed[0] % every == 0:
                self._renderer.show(self.scene(0), self._setup.frames_per_second / every)
            return None
        return tuple(self._renderer.frame(self.scene(lane)) for lane in range(lanes))

    def scene(self, lane: int) -> Scene:
        """What a frame of a lane shows now."""
        simulation, reference = self.simulation, self.simulation.reference
        state = simulation.plant.state
        if self._path is None:
            instants = np.linspace(0.0, self._setup.duration, PATH_POINTS)
            count = len(self.elapsed)
            self._path = np.stack([simulation.trajectory.sample(np.full(count, t))[:2] for t in instants])

        def pair(values: Array) -> tuple[float, float]:
            return float(values[0, lane]), float(values[1, lane])

        return Scene(
            time=float(simulation.time[lane]),
            piston=(float(state[Y1, lane]), float(state[Y2, lane])),
            target=pair(reference.position),
            compliant_target=pair(reference.compliant_target(simulation.force)),
            user_force=pair(simulation.force),
            pressures=tuple(float(state[row, lane]) for row in PRESSURES),  # type: ignore[arg-type]
            stiffness=pair(reference.stiffness),
            path=self._path[:, :, lane],
            title=self._setup.title,
        )

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def start_of(options: dict[str, Any] | None) -> Array | None:
    """Where episodes are to start: ``options["position"]``, (2,), m, or None; ``ValueError`` for other options."""
    if not isinstance(options, dict | None):
        raise ValueError(f"options = {shown(options)}; allowed: None or a dict")
    unknown = set(options or {}) - {"position"}
    if unknown:
        raise ValueError(
            f"options has {', '.join(sorted(map(shown, unknown)))}; allowed: 'position', (x, y) in m, and in vector "
            "environments 'staggered'"
        )
    if not options:
        return None
    try:
        position = floats_of(options["position"])
    except ValueError:
        position = np.empty(0)
    if position.shape != (2,) or not np.isfinite(position).all():
        raise ValueError(f"options['position'] = {shown(options['position'])}; allowed: (x, y), finite, in m")
    return position


@register(device="cpu", about="this processor, all of its cores; arrays are NumPy's")
def on_processor(lanes: int, scenario: str, arguments: Arguments) -> Episodes:
    """Episodes of ``lanes`` lanes here."""
    return Episodes(assemble(lanes, scenario, **arguments))
