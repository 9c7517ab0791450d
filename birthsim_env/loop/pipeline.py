"""The order of a control period: one tuple of named steps that can be read, printed and edited by name.

    env.unwrapped.pipeline                                              # prints what runs, in order
    env.unwrapped.pipeline = env.unwrapped.pipeline.after("plant", my_stage)

A step's part is a ``Stage``, which is compiled, or a Python function that is called with the number of the period in the policy
step; the loop stops for it. ``birthsim_build`` and the page run the same steps in the same ``ORDER``.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self, overload

from birthsim_env.loop.stage import Part, Stage, layouts_of
from birthsim_env.physics.compiled.plain import DEBUG
from birthsim_env.physics.rig.values import near, shown

ORDER = ("actuation", "board", "plant", "target", "setpoints", "start", "hand", "jumps", "sensors", "outcome")
"""Names of the steps of an environment, in the order in which they run.

A group of several steps has names such as ``actuation.ask`` and ``actuation.backstepping``."""


class Step(NamedTuple):
    """A part of a control period under its name.

    Attributes
    ----------
    name : str
        What the step is called; a group of steps has names that begin with that of the group and a dot.
    part : Stage, callable or None
        What runs in every control period, or, of a step that ``closes``, at the end of a policy step; None for nothing.
    begin : Stage, callable or None
        What runs where an episode begins, in all lanes; None for nothing.
    closes : bool
        Whether ``part`` runs once at the end of a policy step instead of in every control period.
    built_in : bool
        Whether the environment itself made the step; its arrays are looked up anew where an episode begins.
    """

    name: str
    part: Part | None
    begin: Part | None = None
    closes: bool = False
    built_in: bool = False

    @property
    def group(self) -> str:
        """The name of the group that the step belongs to, which is its own where it is alone."""
        return self.name.partition(".")[0]


@dataclass(frozen=True)
class Called:
    """A method of a user's ``owner``, which the loop calls back by ``run``."""

    owner: Any
    method: str
    run: Callable[[int], None]

    def __call__(self, period: int) -> None:
        self.run(period)


class Pipeline(tuple[Step, ...]):
    """Steps of a control period in the order in which they run; immutable.

    ``pipeline["plant"]`` is the step of a name. ``replace``, ``before``, ``after`` and ``without`` return another pipeline.
    They take the name of a step or of a group. ``ValueError`` for a name that there is twice, and for one that there is not.
    """

    __slots__ = ()

    def __new__(cls, steps: Iterable[Step] = ()) -> Self:
        """Steps with names of their own."""
        made, seen = super().__new__(cls, steps), set[str]()
        for step in made:
            if not isinstance(step, Step):
                raise ValueError(f"a step of the pipeline = {shown(step)}; allowed: Step(name, part)")
            if step.name in seen:
                raise ValueError(f"name = {step.name!r} is twice in the pipeline; allowed: names that differ")
            seen.add(step.name)
        return made

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the steps, in order."""
        return tuple(step.name for step in self)

    @overload  # type: ignore[override]
    def __getitem__(self, key: int | str) -> Step: ...

    @overload
    def __getitem__(self, key: slice) -> tuple[Step, ...]: ...

    def __getitem__(self, key: int | str | slice) -> Step | tuple[Step, ...]:
        """A step by its name, or steps by their places."""
        if isinstance(key, str):
            return next((step for step in self if step.name == key), None) or self[self._found(key)[0]]
        return super().__getitem__(key)

    def group(self, name: str) -> list[Part]:
        """What runs of a group, empty where there is none of that name."""
        return [step.part for step in self if step.group == name and step.part is not None]

    @property
    def every_period(self) -> list[Part]:
        """What runs in every control period."""
        return [step.part for step in self if step.part is not None and not step.closes]

    @property
    def closing(self) -> list[Part]:
        """What runs at the end of a policy step."""
        return [step.part for step in self if step.part is not None and step.closes]

    @property
    def beginning(self) -> list[Part]:
        """What runs where an episode begins."""
        return [step.begin for step in self if step.begin is not None]

    @property
    def stops(self) -> bool:
        """Whether the loop stops in every period, for what a user has written in Python."""
        return not all(isinstance(part, Stage) for part in self.every_period)

    def replace(self, name: str, part: Part | Step) -> Self:
        """Another part in the place of a step, or of a whole group; it runs when that did, unless it is a ``Step``."""
        found = self._found(name)
        old = self[found[0]]
        if not isinstance(part, Step):
            part = _checked(part)
            part = Step(name, None if old.part is None else part, None if old.begin is None else part, old.closes)
        return type(self)([*self[: found[0]], part, *self[found[-1] + 1 :]])

    def before(self, name: str, *parts: Part | Step) -> Self:
        """More steps before one, or before a group."""
        return self._put(self._found(name)[0], parts)

    def after(self, name: str, *parts: Part | Step) -> Self:
        """More steps after one, or after a group."""
        return self._put(self._found(name)[-1] + 1, parts)

    def without(self, *names: str) -> Self:
        """All but the steps, or groups, of these names."""
        left_out = {place for name in names for place in self._found(name)}
        return type(self)(step for place, step in enumerate(self) if place not in left_out)

    def _put(self, place: int, parts: Sequence[Part | Step]) -> Self:
        names, steps = set(self.names), []
        for part in parts:
            one = part if isinstance(part, Step) else Step(_free(label(_checked(part)), names), part)
            names.add(one.name)
            steps.append(one)
        return type(self)([*self[:place], *steps, *self[place:]])

    def _found(self, name: str) -> list[int]:
        """Places of the step, or else of the group, of a name; there is at least one."""
        exact = [place for place, step in enumerate(self) if step.name == name]
        found = exact or [place for place, step in enumerate(self) if step.group == name]
        if not found:
            known = [*self.names, *(step.group for step in self if step.group != step.name)]
            like = near(name, known) if isinstance(name, str) else ""
            raise ValueError(f"name = {shown(name)}{like} is no step of the pipeline; allowed: {', '.join(self.names)}")
        return found

    def renewed(self, order: Sequence[Step | str], known: Sequence[str]) -> Self:
        """Built-in steps, which these are, in another ``order`` of their names and of a user's own steps.

        Built-in steps that were not ``known`` when the order was given come behind the one that they follow here."""
        own = {step.name: step for step in self}
        steps = [own[one] if isinstance(one, str) else one for one in order if not isinstance(one, str) or one in own]
        before = ""
        for step in self:
            names = [one.name for one in steps]
            if step.name not in known:
                steps.insert(names.index(before) + 1 if before in names else 0, step)
            before = step.name
        return type(self)(steps)

    def __repr__(self) -> str:
        """A table: name, what runs, the layouts that it reads and writes, rows of memory, and when it runs."""
        head = ("step", "runs", "reads and writes", "memory", "when")
        rows = [head, *((step.name, *_told(step.part or step.begin), _when(step)) for step in self)]
        widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
        return "\n".join(
            "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
        )

    __str__ = __repr__


def label(part: Part) -> str:
    """A name for a part: that of its function, or of the module where a function is named for what all are."""
    function: Any = part.function if isinstance(part, Stage) else part
    if isinstance(function, Called):
        return function.method
    name = str(getattr(function, "__name__", type(function).__name__)).strip("_<>")
    if name in ("stage", "law"):
        where = str(function.__module__).split(".")
        name = next((one for one in reversed(where) if one not in ("controller", "stage", "law")), name)
    return name


def group_of(name: str, parts: Sequence[Part], begins: bool = False, period: bool = True) -> list[Step]:
    """Built-in steps of a group: under its name where there is one part, else with the label of each."""
    names, steps = set[str](), []
    for part in parts:
        own = name if len(parts) == 1 else _free(f"{name}.{label(part)}", names)
        names.add(own)
        steps.append(Step(own, part if period else None, part if begins else None, built_in=True))
    return steps


def _free(name: str, taken: set[str]) -> str:
    """The name, with a number where it is taken."""
    others = (f"{name}{number}" for number in range(2, len(taken) + 3))
    return next(one for one in (name, *others) if one not in taken)


def _checked(part: Any) -> Part:
    if not (isinstance(part, Stage) or callable(part)):
        raise ValueError(f"part = {shown(part)}; allowed: a Stage, a function of the number of the period, or a Step")
    found: Part = part
    return found


def _told(part: Part | None) -> tuple[str, str, str]:
    """What runs, the layouts that it names, and the rows of its memory."""
    if isinstance(part, Stage):
        function: Any = getattr(part.function, "py_func", part.function)
        named = ", ".join(layout.__name__ for layout in layouts_of(part.function) if layout)
        memory = f"{len(part.memory)} rows" if part.memory is not None and len(part.memory) else ""
        return f"{function.__module__}:{function.__qualname__}{' (plain Python)' if DEBUG else ''}", named, memory
    if isinstance(part, Called):
        return f"{type(part.owner).__module__}:{type(part.owner).__qualname__}.{part.method} (Python)", "", ""
    where = f"{getattr(part, '__module__', '')}:{getattr(part, '__qualname__', type(part).__qualname__)}"
    return f"{where} (Python)", "", ""


def _when(step: Step) -> str:
    often = [] if step.part is None else ["policy step" if step.closes else "period"]
    return ", ".join([*often, *(["episode begins"] if step.begin is not None else [])])
