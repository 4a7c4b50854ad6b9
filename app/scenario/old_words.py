"""The words of scenarios of schema 1: they are still read, with a warning, and `regrasp migrate` rewrites them."""

import warnings
from collections.abc import Iterator

import yaml

from regrasp.app.files.findings import Finding
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.yaml_lines import Document, parse
from regrasp.app.records.result import OLD_OUTCOMES

_OUTCOME = ("expect", "outcome")


class OldWordWarning(FutureWarning):
    """A file uses a word that has been replaced."""


def warn_of_old_words(document: Document) -> None:
    """Issue an `OldWordWarning`, with file and line, for a scenario of schema 1."""
    word = value_at(document.value, _OUTCOME)
    if isinstance(word, str) and word in OLD_OUTCOMES:
        new = f"expect.outcome: {word} is an old word; write outcome: {OLD_OUTCOMES[word]}, as regrasp migrate does"
        warnings.warn(str(Finding(*document.place(_OUTCOME), new)), OldWordWarning, stacklevel=2)


def migrated(text: str, source: str) -> tuple[str, list[int]]:
    """A scenario's text with the words of today, and the lines that changed; all else stays as it is.

    Raises `Findings` if the text is not YAML.
    """
    parse(text, source)
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    old = {node.start_mark.index: node for node in _outcomes(root) if node.value in OLD_OUTCOMES}
    for begin, node in sorted(old.items(), reverse=True):
        text = text[:begin] + OLD_OUTCOMES[node.value] + text[node.end_mark.index :]
    return text, sorted({node.start_mark.line + 1 for node in old.values()})


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
