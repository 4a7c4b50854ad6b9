"""What was asked of a run: the scenario's own words, its faults, and what else it sets, by the record's copy."""

import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pydantic import BaseModel

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import read_text
from regrasp.app.files.yaml_lines import parse
from regrasp.app.records.reader import RunRecord
from regrasp.app.scenario.schema import fault_types
from regrasp.app.task import find
from regrasp.interfaces.fault import Fault

TOLD_ELSEWHERE = ("type", "when", "name")


@dataclass(frozen=True)
class Asked:
    """What the tree does and what the scenario is, '' where nothing says so; facts, faults in words, and damage."""

    task: str
    description: str
    facts: tuple[tuple[str, str], ...]
    faults: tuple[str, ...]
    again: str  # the command that does the run again, in the record's folder; '' if its scenario is gone
    damage: tuple[str, ...] = ()


def asked(record: RunRecord) -> Asked:
    """What the record says of it."""
    scenario, damage = _scenario(record)
    begin = record.begin
    facts = [(name, _value(begin[name])) for name in ("task", "tree", "cell", "gravity") if begin.get(name)]
    facts += [(name, _value(value)) for name, value in _mapping(begin.get("inputs")).items()]
    if obstacles := scenario.get("obstacles"):
        facts.append(("obstacles", _names(obstacles)))
    if limit := _mapping(begin.get("limits")).get("sim_seconds"):
        facts.append(("time limit", f"{_value(limit)} s"))
    if changed := begin.get("overrides"):
        facts.append(("changed", _value(changed)))
    faults = scenario.get("faults")
    known = _known_faults(record) if faults else {}
    told = tuple(fault_words(one, known) for one in faults if isinstance(one, dict)) if isinstance(faults, list) else ()
    again = f"regrasp run scenario.yaml --seed {shlex.quote(_value(_seed(record)))}" if scenario else ""
    return Asked(_head(record), str(scenario.get("description") or ""), tuple(facts), told, again, damage)


def _head(record: RunRecord) -> str:
    """The comment at the head of the record's tree, which says what it does; '' if there is none."""
    try:
        text = read_text(record.folder / "tree.xml")
    except Findings:
        return ""
    found = re.match(r"\s*(?:<\?xml[^>]*\?>\s*)?<!--(.*?)-->", text, re.DOTALL)
    return " ".join(found[1].split()) if found else ""


def _seed(record: RunRecord) -> Any:
    return record.result.seed if record.result else record.begin.get("seed", 0)


def _scenario(record: RunRecord) -> tuple[Mapping[str, Any], tuple[str, ...]]:
    path = record.folder / "scenario.yaml"
    try:
        document = parse(read_text(path), path.name)
    except Findings as error:
        return {}, (f"scenario.yaml cannot be read: {error.items[0].message}",)
    return _mapping(document.value), ()


def _known_faults(record: RunRecord) -> Mapping[str, type[Fault]]:
    """The faults of the record's task by their types; none if the task is not installed any more."""
    task = record.result.task if record.result else str(record.begin.get("task", ""))
    try:
        return fault_types(find.task_named(task))
    except Findings:
        return {}


def fault_words(fault: Mapping[str, Any], known: Mapping[str, type[BaseModel]] = MappingProxyType({})) -> str:
    """A fault with what it is given: "joint_stalls: arm right, joint shoulder; when node unplug, after 0.3 to 0.8 s".

    `known` holds the models by type; they tell the units.
    """
    model = known.get(str(fault.get("type")))
    own = ", ".join(_words(fault, model, TOLD_ELSEWHERE))
    when = ", ".join(_words(_mapping(fault.get("when")), _model_of(model, "when")))
    told = "; ".join(filter(None, [own, when and f"when {when}"]))
    return f"{fault.get('type', 'a fault')}{told and f': {told}'}"


def _model_of(model: type[BaseModel] | None, field: str) -> type[BaseModel] | None:
    annotation = model.model_fields[field].annotation if model and field in model.model_fields else None
    return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None


def _words(
    values: Mapping[str, Any], model: type[BaseModel] | None = None, without: tuple[str, ...] = ()
) -> Iterator[str]:
    """Each value with its name, and with the unit that the model gives its field."""
    for name, value in values.items():
        if value is not None and name not in without:
            field = model.model_fields.get(name) if model else None
            extra = field.json_schema_extra if field else None
            symbol = extra.get("unit") if isinstance(extra, dict) else None
            yield f"{name} {_value(value)}{f' {symbol}' if symbol else ''}"


def _value(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        both_numbers = len(value) == 2 and all(isinstance(one, (int, float)) for one in value)
        if both_numbers and value[0] == value[1]:
            return _value(value[0])
        return (" to " if both_numbers else ", ").join(map(_value, value))
    if isinstance(value, dict):
        return ", ".join(_words(value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _names(items: Any) -> str:
    named = [str(one.get("name", "one")) for one in items if isinstance(one, dict)] if isinstance(items, list) else []
    return f"{len(named)}: {', '.join(named[:8])}"


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
