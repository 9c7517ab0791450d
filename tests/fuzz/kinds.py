"""All kinds by name."""

from __future__ import annotations

from tests.fuzz.calls import CALLS
from tests.fuzz.commands import COMMANDS
from tests.fuzz.files import FILES
from tests.fuzz.harness import Kind
from tests.fuzz.own_parts import OWN_PARTS
from tests.fuzz.sealed import SEALED

KINDS: dict[str, Kind] = {**FILES, **OWN_PARTS, **SEALED, **CALLS, **COMMANDS}
