"""The words of scenarios of schema 1: they are still read, with a warning, and `regrasp migrate` rewrites them."""

import contextlib
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.overrides import was_typed
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.yaml_lines import Document, parse
from regrasp.app.task.find import old_outcomes

_OUTCOME = ("expect", "outcome")


class OldWordWarning(FutureWarning):
    """A file uses a word that has been replaced."""


def warn_of_old_words(document: Document, old: Mapping[str, str]) -> None:
    """Issue an `OldWordWarning`, with file and line, for a scenario of schema 1; `old` are its task's outcomes then."""
    word = value_at(document.value, _OUTCOME)
    if isinstance(word, str) and word in old:
        place = document.place(_OUTCOME)
        new = f"expect.outcome: {word} is an old word; write outcome: {old[word]}"
        hint = "" if was_typed(place) else ", as regrasp migrate does"
        warnings.warn(str(Finding(*place, new + hint)), OldWordWarning, stacklevel=2)


def migrated(text: str, source: str) -> tuple[str, list[int]]:
    """A scenario's text with the words of today, and the lines that changed; all else stays as it is.

    Raises `Findings` if the text is not YAML, or where only a person can change it: a word that an alias shares.
    """
    wanted = _translated(parse(text, source).value)
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    words = old_outcomes()
    old = {node.start_mark.index: node for node in _outcomes(root) if node.value in words}
    new = text
    for begin, node in sorted(old.items(), reverse=True):
        word = new.rindex(node.value, begin, node.end_mark.index)  # an anchor and quotes stay
        new = new[:word] + words[node.value] + new[word + len(node.value) :]
    lines = sorted({node.start_mark.line + 1 for node in old.values()})
    with contextlib.suppress(Findings):
        if parse(new, source).value == wanted:
            return new, lines
    message = "an outcome has an old word that an alias or a merge shares; change it by hand"
    raise Findings([Finding(source, lines[0] if lines else 0, message)])


def _translated(value: Any) -> Any:
    """A scenario's plain value with the words of today."""
    if not isinstance(value, dict):
        return value
    made = dict(value)
    if isinstance(value.get("expect"), dict):
        made["expect"] = _with_new_outcome(value["expect"])
    if isinstance(value.get("vary"), dict):
        axes = dict(value["vary"])
        if isinstance(axes.get("expect"), list):
            axes["expect"] = [_with_new_outcome(item) for item in axes["expect"]]
        if isinstance(axes.get(key := ".".join(_OUTCOME)), list):
            axes[key] = [_new_word(item) for item in axes[key]]
        made["vary"] = axes
    return made


def _with_new_outcome(expect: Any) -> Any:
    if not isinstance(expect, dict) or "outcome" not in expect:
        return expect
    return {**expect, "outcome": _new_word(expect["outcome"])}


def _new_word(word: Any) -> Any:
    return old_outcomes().get(word, word) if isinstance(word, str) else word


def _outcomes(root: yaml.Node | None) -> Iterator[yaml.ScalarNode]:
    """The scalars at expect.outcome, and those that `vary` puts there."""
    expected, found = _at(root, "expect"), []
    for vary in _at(root, "vary"):
        expected += [item for axis in _at(vary, "expect") for item in _in(axis)]
        found += [item for axis in _at(vary, ".".join(_OUTCOME)) for item in _in(axis)]
    found += [node for mapping in expected for node in _at(mapping, "outcome")]
    return (node for node in found if isinstance(node, yaml.ScalarNode))


def _at(node: yaml.Node | None, name: str) -> list[yaml.Node]:
    """What a mapping holds at the key `name`."""
    return [value for key, value in node.value if key.value == name] if isinstance(node, yaml.MappingNode) else []


def _in(node: yaml.Node) -> list[yaml.Node]:
    """The items of a sequence."""
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []
