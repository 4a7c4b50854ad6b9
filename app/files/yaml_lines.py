"""Parses YAML into plain values with their lines, and reports what YAML parsers accept silently: doubled keys, ..."""

import math
import re
from dataclasses import dataclass, field
from typing import Any

import yaml

from regrasp.app.files.findings import Finding, Findings
from regrasp.interfaces.quote import MAX_QUOTE, cut, quoted

Value = None | bool | int | float | str | list["Value"] | dict[str, "Value"]
Path = tuple[str | int, ...]
Place = tuple[str, int]  # source and line

MAX_NESTING = 20
MAX_VALUES = 20_000  # after aliases are expanded
# Numbers in both YAML 1.1 and 1.2: not 010, 1_000, 1:30 or 1e3.
_NUMBER = re.compile(r"[-+]?(0|[1-9]\d{0,18}|(0|[1-9]\d{0,18})?\.\d{0,30}([eE][-+]\d{1,3})?)")
_LOOKS_LIKE_NUMBER = re.compile(r"([-+]?)(\d+(?:\.\d*)?|\.\d+)[eE]([-+]?)(\d+)")
_TAG = "tag:yaml.org,2002:"
_REMEDIES = {  # by words in PyYAML's message
    "'\\t'": "indent with spaces, not with tabs",
    "another document": "keep one document in a file",
    "undefined alias": "define it before as &name, or put text that begins with * in quotes",
    "duplicate anchor": "give each & another name",
    "expected ',' or": "close the bracket, or put a comma between the items",
    "mapping values are not allowed": "put text that holds a colon and a blank in quotes, and indent keys alike",
    "could not find expected ':'": "write key: value",
    "expected <block end>": "indent the keys of a mapping alike",
    "end of stream": "close the quotes",
    "escape": "write a backslash twice, or use single quotes",
}


@dataclass
class Document:
    """Plain values, and for every path in them its place (source and line).

    Values that could not be read are None; their paths are in `unread`, and what is wrong is in `findings`.
    """

    value: Value
    places: dict[Path, Place]
    findings: list[Finding] = field(default_factory=list)
    unread: set[Path] = field(default_factory=set)

    def place(self, path: Path) -> Place:
        """The place of `path`, or of the innermost value around it that has one."""
        while path not in self.places:
            path = path[:-1]
        return self.places[path]

    def place_of_whole(self, path: Path) -> Place:
        """Of a mapping whose values contradict each other: the first that another file put into it, else its own."""
        own = self.place(path)
        inside = [place for p, place in self.places.items() if p[: len(path)] == path and place[0] != own[0]]
        return min(inside, key=lambda place: place[1], default=own)

    def rename(self, path: Path, name: str) -> None:
        """Rename the key at `path`, which must exist."""
        self.move(path, (*path[:-1], name))

    def move(self, path: Path, new: Path) -> None:
        """Move the value at `path`, which must exist, to `new`; missing mappings on the way are added."""
        parent: Any = self.value
        for step in path[:-1]:
            parent = parent[step]
        value, parent = parent.pop(path[-1]), self.value
        for length, step in enumerate(new[:-1], 1):
            if isinstance(parent, dict) and parent.get(step) is None:
                parent[step] = {}
                self.places.setdefault(new[:length], self.place(path))
            parent = parent[step]
        parent[new[-1]] = value
        inside = len(path)
        for old in [p for p in self.places if p[:inside] == path]:
            self.places[new + old[inside:]] = self.places.pop(old)
        self.unread = {new + p[inside:] if p[:inside] == path else p for p in self.unread}

    def items(self, path: Path) -> list["Document"]:
        """The items of the list at `path`, which must exist; their findings stay here."""
        value: Any = self.value
        for step in path:
            value = value[step]
        made = [Document(item, {}) for item in value]
        inside = len(path)
        for p, place in self.places.items():
            if p[:inside] == path and len(p) > inside:
                made[int(p[inside])].places[p[inside + 1 :]] = place
        for p in self.unread:
            if p[:inside] == path and len(p) > inside:
                made[int(p[inside])].unread.add(p[inside + 1 :])
        return made


def parse(text: str, source: str, line: int | None = None) -> Document:
    """Read one YAML document. If `line` is given (for a value from the command line), all findings have that line.

    Doubled keys, tags, and numbers that are not plain and finite are `findings` of the document. Raises `Findings` if
    the text is malformed, nested too deeply, or too large when its aliases are expanded.
    """
    builder = _Builder(source, line)
    try:
        node = _compose(text, source, line)
    except yaml.MarkedYAMLError as error:
        at = error.problem_mark.line + 1 if error.problem_mark else 1
        raise _not_yaml(source, at if line is None else line, error.problem or str(error.context)) from None
    except yaml.reader.ReaderError as error:
        at = text.count("\n", 0, error.position) + 1
        message = f"not YAML: {chr(error.character)!r} is not text; remove it"
        raise Findings([Finding(source, at if line is None else line, message)]) from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # an escape beyond Unicode is a bare ValueError
        raise _not_yaml(source, 1 if line is None else line, str(error)) from None
    value = None if node is None else builder.build(node, (), 0)
    builder.places.setdefault((), (source, 1 if line is None else line))
    return Document(value, builder.places, builder.findings, builder.unread)


def _not_yaml(source: str, line: int, problem: str) -> Findings:
    remedy = next((r for words, r in _REMEDIES.items() if words in problem), "write it such as key: value")
    return Findings([Finding(source, line, f"not YAML: {cut(problem, 2 * MAX_QUOTE)}; {remedy}")])


def _compose(text: str, source: str, line: int | None) -> yaml.Node | None:
    """The document's node, read by libyaml, which is ten times as fast; PyYAML's own parser says what is wrong."""
    for loader in (getattr(yaml, "CSafeLoader", yaml.SafeLoader), yaml.SafeLoader):
        try:
            _limit_nesting(text, source, line, loader)
            return yaml.compose(text, Loader=loader)
        except (yaml.YAMLError, ValueError, OverflowError):
            if loader is yaml.SafeLoader:
                raise
    return None


def _limit_nesting(text: str, source: str, line: int | None, loader: type) -> None:
    """Raise `Findings` for deep nesting, before `compose`, which recurses."""
    depth = 0
    for event in yaml.parse(text, Loader=loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_NESTING:
            at = event.start_mark.line + 1 if event.start_mark else 1
            message = f"nests deeper than {MAX_NESTING} levels; a file of ours needs fewer than 10"
            raise Findings([Finding(source, at if line is None else line, message)])


@dataclass
class _Builder:
    source: str
    line: int | None
    places: dict[Path, Place] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    unread: set[Path] = field(default_factory=set)
    count: int = 0
    aliases: bool = False  # whether any node was built twice
    _built: set[int] = field(default_factory=set)  # ids of nodes

    def _line(self, node: yaml.Node) -> int:
        return int(node.start_mark.line) + 1 if self.line is None else self.line

    def wrong(self, node: yaml.Node, message: str, path: Path | None = None) -> None:
        """Note a finding; `path` is that of a value that cannot be read because of it."""
        self.findings.append(Finding(self.source, self._line(node), message))
        if path is not None:
            self.unread.add(path)

    def charge(self, node: yaml.Node, values: int, depth: int) -> None:
        """Count the values, and raise `Findings` if there are too many: aliases may expand without end."""
        self.count += values
        if depth > MAX_NESTING or self.count > MAX_VALUES:
            if self.aliases:
                message = (
                    f"aliases expand to more than {MAX_VALUES} values or {MAX_NESTING} levels; write out what is meant"
                )
            else:
                message = f"more than {MAX_VALUES} values; shorten the file, or split it"
            self.wrong(node, message)
            raise Findings(self.findings)

    def build(self, node: yaml.Node, path: Path, depth: int, at: yaml.Node | None = None) -> Value:
        """The plain value of `node`; its line is that of `at` (its key), if given."""
        self.aliases |= id(node) in self._built
        self._built.add(id(node))
        self.charge(node, 1, depth)
        self.places[path] = (self.source, self._line(at or node))
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            pairs = self.pairs(node, depth)
            return {name: self.build(child, (*path, name), depth + 1, key) for name, (key, child) in pairs.items()}
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [self.build(child, (*path, i), depth + 1) for i, child in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode):
            return self.scalar(node, path)
        self.wrong(node, f"tag {quoted(node.tag)} is not allowed; write plain values", path)
        return None

    def pairs(self, node: yaml.MappingNode, depth: int) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        """The nodes of key and value by name; the mapping's own keys replace those that `<<` merges in."""
        self.charge(node, len(node.value), depth)
        merged: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        own: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for key, value in node.value:
            if key.tag == _TAG + "merge":
                merged = self.merged(value, depth) | merged
            elif not isinstance(key, yaml.ScalarNode):
                self.wrong(key, "a key must be a name; write text before the colon")
            elif key.value in own:
                self.wrong(key, f"key {quoted(key.value)} stands twice; keep one")
            else:
                own[key.value] = (key, value)
        return merged | own

    def merged(self, node: yaml.Node, depth: int) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        self.aliases = True
        parts = node.value if isinstance(node, yaml.SequenceNode) else [node]
        result: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        for part in reversed(parts):  # the first of several wins
            if isinstance(part, yaml.MappingNode):
                result |= self.pairs(part, depth + 1)
            else:
                self.wrong(part, "'<<' takes a mapping; name the alias of one, such as *a")
        return result

    def scalar(self, node: yaml.ScalarNode, path: Path) -> Value:
        kind = node.tag.removeprefix(_TAG)
        text = str(node.value)
        if kind == "null":
            return None
        if kind == "bool":
            return yaml.SafeLoader.bool_values.get(text.lower())
        if kind in ("int", "float") or (not node.style and _LOOKS_LIKE_NUMBER.fullmatch(text)):
            if _NUMBER.fullmatch(text) and math.isfinite(float(text)):
                return float(text) if set(text) & set(".eE") else int(text)
            self.wrong(node, _not_a_number(text), path)
            return None
        if kind in ("str", "timestamp", "value"):
            return text
        self.wrong(node, f"tag {quoted(node.tag)} is not allowed; write plain values", path)
        return None


def _not_a_number(text: str) -> str:
    """Why a number that YAML parsers read differently is refused, and how to write it."""
    if match := _LOOKS_LIKE_NUMBER.fullmatch(text):
        sign, digits, power_sign, power = match.groups()
        right = f"{sign}{digits if '.' in digits else digits + '.0'}e{power_sign or '+'}{power}"
        if right != text:
            return f"{quoted(text)} is text to YAML, not a number; write {cut(right)}"
    try:
        read = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, OverflowError):  # Python refuses to read thousands of digits
        read = None
    if isinstance(read, int | float) and abs(read) < 1e15:  # nan is not
        both = f"{quoted(text)} is {read} to some readers of YAML and not to others"
        return f"{both}; write {read}, or quotes around text"
    return f"{quoted(text)} is no plain finite number; write it such as 1000, 0.3 or 1.0e+3"
