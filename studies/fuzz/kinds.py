"""All kinds by name."""

from studies.fuzz.calls import CALLS
from studies.fuzz.commands import COMMANDS
from studies.fuzz.files import FILES
from studies.fuzz.harness import Kind
from studies.fuzz.json_files import JSON_FILES
from studies.fuzz.logs import LOGS
from studies.fuzz.own_parts import OWN_PARTS
from studies.fuzz.sealed import SEALED
from studies.fuzz.states import STATES
from studies.fuzz.tables import TABLES

KINDS: dict[str, Kind] = FILES | JSON_FILES | LOGS | OWN_PARTS | TABLES | SEALED | STATES | CALLS | COMMANDS
