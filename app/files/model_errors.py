"""All errors of a plain value against a pydantic model at once.

Pydantic itself reports some errors only when others are corrected: conditions on several fields when each field is
valid, and the fields of a union's member when its tag is valid.
"""

import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from copy import deepcopy
from functools import partial
from typing import NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from regrasp.app.files.schema_nodes import Schema, child, nodes_at, value_at
from regrasp.app.files.yaml_lines import Path, Value
from regrasp.interfaces.quote import closest

TAG_ERRORS = ("union_tag_invalid", "union_tag_not_found")
MAX_ERRORS_LOOKED_INTO = 100  # with more errors a value was not written by hand


class ModelError(NamedTuple):
    """An error of pydantic; `path` leads to the value, or to the place where a missing one belongs."""

    path: Path
    details: ErrorDetails

    @property
    def is_of_several(self) -> bool:
        """Whether it concerns several values of a mapping together, each of them valid by itself."""
        return self.details["type"] == "value_error" and isinstance(self.details["input"], dict)


def model_errors(value: Value, model: type[BaseModel], root: Schema) -> list[ModelError]:
    """All errors, without those that only follow from another one; `root` is the model's JSON schema."""
    first = first_errors(value, model)
    if not first or len(first) > MAX_ERRORS_LOOKED_INTO:
        return first
    wrong_tags = [error.path for error in first if error.details["type"] in TAG_ERRORS]
    tags = sorted({tag for path in wrong_tags for tag in _tags(root, path, value)})
    rounds = [_looked_into(_with_tags(value, wrong_tags, tag), model, root) for tag in tags or [""]]
    seen = {_identity(error) for error in first}
    in_all = set.intersection(*({_identity(error) for error in found} for found in rounds))  # whichever tag is meant
    return first + [error for error in rounds[0] if _identity(error) in in_all - seen]


def misspelt(value: Value, model: type[BaseModel], root: Schema) -> Iterator[tuple[Path, str]]:
    """Unknown keys, each with the missing key that is probably meant."""
    errors = model_errors(value, model, root)
    for path, details in errors if len(errors) <= MAX_ERRORS_LOOKED_INTO else []:
        parent = value_at(value, path[:-1])
        if not isinstance(parent, dict):
            continue
        known = {name for node in nodes_at(root, path[:-1], value) for name in node.get("properties", {})}
        if details["type"] == "extra_forbidden" and (meant := closest(str(path[-1]), known - parent.keys())):
            yield path, meant
        if details["type"] == "union_tag_not_found" and (key := closest(str(path[-1]), parent.keys() - known)):
            yield (*path[:-1], key), str(path[-1])


def first_errors(value: Value, model: type[BaseModel]) -> list[ModelError]:
    """The errors that pydantic reports at once; strict: text is not taken for a number."""
    try:
        model.model_validate_json(json.dumps(value), strict=True)
    except ValidationError as error:
        return _without_lengths(_best_branches(value, error.errors()))
    return []


def _without_lengths(errors: list[ModelError]) -> list[ModelError]:
    """Without those of lists that are too short only because pydantic does not count the items that are wrong."""
    parents = {error.path[:length] for error in errors for length in range(len(error.path))}
    return [error for error in errors if error.details["type"] != "too_short" or error.path not in parents]


def _identity(error: ModelError) -> tuple[Path, str, str]:
    return error.path, error.details["type"], error.details["msg"]


def _tags(root: Schema, path: Path, value: Value) -> Iterator[str]:
    return (str(node["const"]) for node in nodes_at(root, path, value) if "const" in node)


def _with_tags(value: Value, paths: Sequence[Path], tag: str) -> Value:
    value = deepcopy(value)
    for path in paths:
        _put(value, path, tag)
    return value


def _looked_into(value: Value, model: type[BaseModel], root: Schema) -> list[ModelError]:
    """The errors, and those on several values together, which show when the others are replaced by examples."""
    found = first_errors(value, model)
    mended = deepcopy(value)
    for path, details in found:
        if details["type"] != "extra_forbidden":
            _exemplify(mended, path, root)
    return found + [error for error in first_errors(mended, model) if error.is_of_several]


def _exemplify(value: Value, path: Path, root: Schema) -> None:
    """Put the example of the innermost field around `path` that has one."""
    for length in range(len(path), 0, -1):
        step = path[length - 1]
        fields = [node.get("properties", {}).get(step, {}) for node in nodes_at(root, path[: length - 1], value)]
        if examples := [field["examples"][0] for field in fields if "examples" in field]:
            _put(value, path[:length], examples[0])
            return


def _put(value: Value, path: Path, new: Value) -> None:
    """Store `new` at `path` if its parent is a mapping."""
    parent = value_at(value, path[:-1])
    if isinstance(parent, dict):
        parent[str(path[-1])] = deepcopy(new)


def _best_branches(value: Value, errors: Sequence[ErrorDetails]) -> list[ModelError]:
    """The errors; of a union only those of the branch with the fewest errors, at a tie of the one that got furthest."""
    unions: dict[Path, dict[str | int, list[ModelError]]] = defaultdict(lambda: defaultdict(list))
    kept = []
    for details in errors:
        error, beside = _located(value, details)
        if beside:
            spot = details["loc"][: details["loc"].index(beside[0])]
            unions[spot][beside[0]].append(error)
        else:
            kept.append(error)
    best = (min(branches.values(), key=partial(_badness, spot)) for spot, branches in unions.items())
    return kept + [error for errors in best for error in errors]


def _located(value: Value, details: ErrorDetails) -> tuple[ModelError, Path]:
    """The error with its path in the file, and the steps of pydantic's location that are not in the file: branches."""
    path: Path = ()
    beside: Path = ()
    for step in details["loc"]:
        held, value = child(value, step)
        path, beside = ((*path, step), beside) if held else (path, (*beside, step))
    if details["type"] == "missing":  # the last step: a key, or an item of a list that is too short
        path, beside = (*path, *(step for step in beside[-1:] if isinstance(step, str))), beside[:-1]
    elif details["type"] in TAG_ERRORS:
        path = (*path, details["ctx"]["discriminator"].strip("'"))
    return ModelError(path, details), beside


def _badness(spot: tuple[str | int, ...], errors: Sequence[ModelError]) -> tuple[bool, int, int, bool]:
    """A sort key: lowest for the branch that is probably meant, of the union at pydantic's location `spot`.

    A branch that takes no value of this type comes last. Our own validators report errors only if the type is right.
    """
    kinds = {error.details["type"] for error in errors}
    wants = {error.details["type"] for error in errors if len(error.details["loc"]) == len(spot) + 1}
    other_type = bool(wants & {"tuple_type", "model_type", "dict_type", "list_type", "model_attributes_type"})
    return other_type, len(errors), -max(len(error.details["loc"]) for error in errors), "value_error" not in kinds
