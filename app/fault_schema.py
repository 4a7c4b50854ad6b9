"""The faults that a scenario file may name: `type` says which."""

from typing import Annotated, get_args

from pydantic import Field

from regrasp.interfaces.fault import AnyFault

FaultSpec = Annotated[AnyFault, Field(discriminator="type")]
FAULT_TYPES: dict[str, type] = {get_args(f.model_fields["type"].annotation)[0]: f for f in get_args(AnyFault)}
