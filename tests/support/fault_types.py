"""The faults' classes by the words that name them in a file."""

from typing import get_args

from regrasp.interfaces.fault import FAULTS, Fault

FAULT_TYPES: dict[str, type[Fault]] = {get_args(kind.model_fields["type"].annotation)[0]: kind for kind in FAULTS}
