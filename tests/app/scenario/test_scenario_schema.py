import functools
import json
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml
from pydantic import BaseModel, create_model
from pydantic.fields import FieldInfo
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.load import cases, load_scenario
from regrasp.app.scenario.schema import ScenarioFile, json_schema, scenario_model
from regrasp.app.task.task import Task
from regrasp.app.tasks.cable import TASK
from regrasp.app.tasks.cable.expectations import Expect
from regrasp.interfaces.cable.fault import CableSnags
from regrasp.interfaces.fault import JawOpens

OURS = {ours.__module__ for ours in (ScenarioFile, Expect, JawOpens, CableSnags)}


def fields(model: type[BaseModel]) -> Iterator[tuple[str, FieldInfo]]:
    """Every field of a model and of the models in it that scenarios have to themselves."""
    for name, info in model.model_fields.items():
        yield f"{model.__name__}.{name}", info
        for inner in models(info.annotation):
            yield from fields(inner)


def models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if annotation.__module__ in OURS:
            yield annotation
        return
    for part in get_args(annotation):
        yield from models(part)


MODEL = scenario_model(TASK)
FIELDS = dict(fields(MODEL))


def test_the_fields_of_all_parts_are_looked_at() -> None:
    some = {"ObstacleSpec.size", "ByGravity.zero", "Expect.pose_error", "PoseError.position", "Steps.first"}
    assert some | {"JawOpens.when", "CameraDrops.share", "When.node"} <= set(FIELDS)


@pytest.mark.parametrize("name", FIELDS)
def test_a_field_says_what_it_means_and_gives_an_example_that_holds(name: str) -> None:
    info = FIELDS[name]
    assert info.description
    assert info.description.endswith(".")
    assert info.examples
    parts: dict[str, Any] = {"field": (info.annotation, info)}
    model = create_model("OneField", **parts)
    for example in info.examples:
        model.model_validate_json(json.dumps({info.alias or "field": example}), strict=True)


def test_the_json_schema_is_whole() -> None:
    schema = json_schema(TASK)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert set(schema["properties"]) == set(MODEL.model_fields)
    assert schema["additionalProperties"] is False
    references = set(_references(schema))
    assert references == {f"#/$defs/{name}" for name in schema["$defs"]}
    assert json.loads(json.dumps(schema, allow_nan=False)) == schema


def _references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if "$ref" in node:
            yield node["$ref"]
        for below in node.values():
            yield from _references(below)
    if isinstance(node, list):
        for below in node:
            yield from _references(below)


def test_the_command_prints_the_schema_and_a_reference_with_every_field() -> None:
    assert json.loads(CliRunner().invoke(app, ["scenarios", "schema", "--task", "cable"]).stdout) == json_schema(TASK)
    text = CliRunner().invoke(app, ["scenarios", "schema", "--task", "cable", "--markdown"]).stdout
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    assert all(line.replace("\\|", "").count("|") == 7 for line in rows)
    for name, info in FIELDS.items():
        assert f"| `{info.alias or name.split('.')[1]}` |" in text
        assert str(info.description) in text
    assert "| `size` | 3 x number (at least 0.001, at most 3) | metres | required |" in text


@pytest.mark.parametrize(("task", "name"), [("cable", "SCHEMA.md"), ("printer", "SCHEMA_PRINTER.md")])
def test_the_reference_that_ships_is_what_the_command_prints(task: str, name: str) -> None:
    """Where this fails: `regrasp scenarios schema --task cable --markdown > scenarios/SCHEMA.md`, and so on."""
    shipped = (files("regrasp.scenarios") / name).read_text(encoding="utf-8")
    assert CliRunner().invoke(app, ["scenarios", "schema", "--task", task, "--markdown"]).stdout == shipped


@functools.cache
def with_jsonschema(task: Task = TASK) -> Any:
    """A validator of the published schema, from a library that only this test would need."""
    return pytest.importorskip("jsonschema").Draft202012Validator(json_schema(task))


def test_every_shipped_scenario_is_right_by_the_published_schema() -> None:
    for path in shipped("scenario").values():
        validator = with_jsonschema(load_scenario(str(path)).task)
        assert [error.message for error in validator.iter_errors(yaml.safe_load(path.read_text()))] == []


_WHOLE = {"description": "d", "cell": "thesis", "tree": "recovery", "gravity": "zero"}


@pytest.mark.parametrize(
    "changes",
    [
        *({key: None, "vary": {key: [value]}} for key, value in _WHOLE.items()),
        {"gravity": None},
        {"gravity": None, "vary": {"seed": "0:2"}},
        {"gravity": None, "vary": {"gravity": []}},
        {"gravty": "zero"},
        {"vary": {"seed": "0-2"}},
        {"vary": {"light.brightness": {"from": 0.5, "to": 1.0, "steps": 2}}},
        {"inputs": {"tries": "{x}"}},
        {"faults": [{"type": "jaw_opens", "when": {"at": [1, 2]}}]},
        {"faults": [{"type": "camera_dark", "when": {"at": [1, 2]}}]},
        {"faults": [{"type": "camera_dark", "when": {"at": [1, 2]}}], "vary": {"faults.0.camera": ["rear"]}},
    ],
    ids=json.dumps,
)
def test_the_published_schema_takes_what_the_check_takes(tmp_path: Path, changes: dict[str, Any]) -> None:
    content = {key: value for key, value in (_WHOLE | changes).items() if value is not None}
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    try:
        cases(str(path))
        taken = True
    except Findings:
        taken = False
    assert with_jsonschema().is_valid(content) == taken


def test_a_key_that_a_file_must_have_may_stand_in_vary_alone() -> None:
    """As the schema says it: each such key at the top, or in `vary`."""
    gravity = {"required": ["vary"], "properties": {"vary": {"required": ["gravity"]}}}
    assert {"anyOf": [{"required": ["gravity"]}, gravity]} in json_schema(TASK)["allOf"]
    assert len(json_schema(TASK)["allOf"]) == len(_WHOLE)
