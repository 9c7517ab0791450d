"""What leaves BirthSIM: a module a kind of file, which registers its forms for ``birthsim export --to FORM``."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Form:
    """How a form is written: the settings that are read, what writes it, and an example's arguments after ``--to FORM``."""

    settings: type[Any]
    write: Callable[[Any], None]
    example: str
