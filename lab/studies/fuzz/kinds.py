"""All kinds by name."""

from lab.studies.fuzz.calls import CALLS
from lab.studies.fuzz.commands import COMMANDS
from lab.studies.fuzz.files import FILES
from lab.studies.fuzz.harness import Kind
from lab.studies.fuzz.json_files import JSON_FILES
from lab.studies.fuzz.logs import LOGS
from lab.studies.fuzz.own_parts import OWN_PARTS
from lab.studies.fuzz.sealed import SEALED
from lab.studies.fuzz.states import STATES
from lab.studies.fuzz.tables import TABLES

KINDS: dict[str, Kind] = FILES | JSON_FILES | LOGS | OWN_PARTS | TABLES | SEALED | STATES | CALLS | COMMANDS
