"""All kinds by name."""

from __future__ import annotations

from tests.fuzz.calls import CALLS
from tests.fuzz.checkpoints import CHECKPOINTS
from tests.fuzz.commands import COMMANDS
from tests.fuzz.files import FILES
from tests.fuzz.harness import Kind
from tests.fuzz.own_parts import OWN_PARTS

KINDS: dict[str, Kind] = {**FILES, **OWN_PARTS, **CHECKPOINTS, **CALLS, **COMMANDS}
