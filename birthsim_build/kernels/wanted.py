"""Which kernels are built: those that loops call by address, as declarations say, and what users' paths ask for besides."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any, NamedTuple, get_type_hints

from birthsim_env.gradients.source import module_of
from birthsim_env.loop.stage import layouts_of
from birthsim_env.physics.compiled.compilation import Kernel
from birthsim_env.physics.compiled.sources import ROOT, files_of

PACKAGES = ("birthsim_env", "baselines", "agents", "birthsim_live")
"""Whose kernels run in blocks of lanes; those of ``birthsim_build`` run in what it builds."""


class Wanted(NamedTuple):
    """A kernel with the kinds of its arguments, as ``compiled.prebuilt`` writes them."""

    kernel: Kernel
    kinds: tuple[str, ...]

    @property
    def key(self) -> str:
        """What the index calls it."""
        function = self.kernel.py_func
        return " ".join((f"{function.__module__}.{function.__qualname__}", *self.kinds))


def declared() -> list[Wanted]:
    """Kernels of whole numbers and blocks of named rows that return one, as stages do: loops call them by address."""
    return [Wanted(kernel, ("i",) * len(layouts_of(kernel))) for kernel in _kernels() if _is_of_numbers(kernel)]


def asked(keys: list[str], texts: list[str]) -> list[Wanted]:
    """Kernels by their keys; ``texts`` are the sources of generated modules."""
    generated = {module.__name__: module for module in map(module_of, texts)}
    found = []
    for key in keys:
        name, *kinds = key.split(" ")
        module, _, own = name.rpartition(".")
        found.append(Wanted(getattr(generated.get(module) or import_module(module), own), tuple(kinds)))
    return found


def _kernels() -> Iterator[Kernel]:
    for path in files_of(*PACKAGES):
        # Modules that have none may need what is not installed.
        if "\n@kernel\n" in path.read_text(encoding="utf-8"):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            module = import_module(name.removesuffix(".__init__"))
            yield from (
                one
                for one in vars(module).values()
                if isinstance(one, Kernel) and not one.inlined and one.__module__ == module.__name__
            )


def _is_of_numbers(kernel: Any) -> bool:
    hints = get_type_hints(kernel.py_func)
    if hints.pop("return", None) is not int:
        return False
    return all(kind is int or layout for kind, layout in zip(hints.values(), layouts_of(kernel), strict=True))
