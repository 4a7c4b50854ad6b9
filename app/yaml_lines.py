"""YAML as plain values that remember where each came from, with findings for all that YAML lets pass in silence."""

import math
import re
from dataclasses import dataclass, field

import yaml

from app.findings import Finding, Findings

Value = None | bool | int | float | str | list["Value"] | dict[str, "Value"]
Path = tuple[str | int, ...]
Place = tuple[str, int]  # source and line

MAX_DEPTH = 20
MAX_VALUES = 20_000  # after aliases are expanded
# What YAML 1.1 and 1.2 both read as a number, so not 010, 1_000, 1:30 or 1e3.
_NUMBER = re.compile(r"[-+]?(0|[1-9]\d{0,18}|(0|[1-9]\d{0,18})?\.\d{0,30}([eE][-+]\d{1,3})?)")
_LOOKS_LIKE_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")
_TAG = "tag:yaml.org,2002:"


@dataclass
class Document:
    """Plain values and, for every path in them, the place where it stands."""

    value: Value
    places: dict[Path, Place]

    def place(self, path: Path) -> Place:
        """Where `path` stands, or the nearest thing around it that stands anywhere."""
        while path not in self.places:
            path = path[:-1]
        return self.places[path]


def parse(text: str, source: str, line: int | None = None) -> Document:
    """Read one YAML document; every line is reported as `line` when that is given (a value from the command line).

    Raises `Findings`: malformed text, duplicate or unreadable keys, tags, numbers that are not plain and finite, too
    deep or too large once aliases are expanded.
    """
    builder = _Builder(source, line)
    try:
        _limit_nesting(text)
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        at = error.problem_mark.line + 1 if error.problem_mark else 1
        raise Findings([Finding(source, line or at, f"not YAML: {error.problem or error.context}")]) from None
    except yaml.reader.ReaderError as error:
        at = text.count("\n", 0, error.position) + 1
        raise Findings([Finding(source, line or at, f"not YAML: {chr(error.character)!r} is not text")]) from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape beyond Unicode is a bare ValueError
        raise Findings([Finding(source, line or 1, f"not YAML: {error}")]) from None
    value = None if node is None else builder.build(node, (), 0)
    builder.places.setdefault((), (source, line or 1))
    if builder.findings:
        raise Findings(builder.findings)
    return Document(value, builder.places)


def _limit_nesting(text: str) -> None:
    """Refuse deep nesting before `compose`, which recurses."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            at = event.start_mark.line + 1 if event.start_mark else 1
            raise ValueError(f"line {at} nests deeper than {MAX_DEPTH} levels")


@dataclass
class _Builder:
    source: str
    line: int | None
    places: dict[Path, Place] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    count: int = 0

    def wrong(self, node: yaml.Node, message: str) -> None:
        self.findings.append(Finding(self.source, self.line or node.start_mark.line + 1, message))

    def charge(self, node: yaml.Node, values: int, depth: int) -> None:
        """Count what is built; only aliases, of themselves or of one another, go past the limits."""
        self.count += values
        if depth > MAX_DEPTH or self.count > MAX_VALUES:
            self.wrong(node, f"aliases expand to more than {MAX_VALUES} values or {MAX_DEPTH} levels")
            raise Findings(self.findings)

    def build(self, node: yaml.Node, path: Path, depth: int, at: yaml.Node | None = None) -> Value:
        """The plain value of `node`, which stands where `at` (its key) stands."""
        self.charge(node, 1, depth)
        self.places[path] = (self.source, self.line or (at or node).start_mark.line + 1)
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            pairs = self.pairs(node, depth)
            return {name: self.build(child, (*path, name), depth + 1, key) for name, (key, child) in pairs.items()}
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [self.build(child, (*path, i), depth + 1) for i, child in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode):
            return self.scalar(node)
        self.wrong(node, f"tag {node.tag!r} is not allowed; write plain values")
        return None

    def pairs(self, node: yaml.MappingNode, depth: int) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        """Name to key and value node; what `<<` brings in comes first and yields to the mapping's own keys."""
        self.charge(node, len(node.value), depth)
        merged: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        own: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for key, value in node.value:
            if key.tag == _TAG + "merge":
                merged = self.merged(value, depth) | merged
            elif not isinstance(key, yaml.ScalarNode):
                self.wrong(key, "a key must be a name")
            elif key.value in own:
                self.wrong(key, f"key {key.value!r} stands twice; keep one")
            else:
                own[key.value] = (key, value)
        return merged | own

    def merged(self, node: yaml.Node, depth: int) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        parts = node.value if isinstance(node, yaml.SequenceNode) else [node]
        result: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for part in reversed(parts):  # the first of several wins
            if isinstance(part, yaml.MappingNode):
                result |= self.pairs(part, depth + 1)
            else:
                self.wrong(part, "'<<' takes a mapping, such as an alias of one")
        return result

    def scalar(self, node: yaml.ScalarNode) -> Value:
        kind = node.tag.removeprefix(_TAG)
        text = str(node.value)
        if kind == "null":
            return None
        if kind == "bool":
            return yaml.SafeLoader.bool_values.get(text.lower())
        if kind in ("int", "float") or (node.style is None and _LOOKS_LIKE_NUMBER.fullmatch(text)):
            return self.number(node, text)
        if kind in ("str", "timestamp", "value"):
            return text
        self.wrong(node, f"tag {node.tag!r} is not allowed; write plain values")
        return None

    def number(self, node: yaml.ScalarNode, text: str) -> Value:
        if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
            self.wrong(node, f"{text[:40]!r} is no plain finite number; write it such as 1000, 0.3 or 1.0e+3")
            return None
        return float(text) if set(text) & set(".eE") else int(text)
