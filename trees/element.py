"""Tree files as plain elements that know their line."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

MAX_DEPTH = 60  # elements inside one another; the parser that builds the tree is recursive
_KEY = re.compile(r"\{([A-Za-z_]\w*)\}")


class TreeSyntaxError(ValueError):
    """A tree file that is no XML, or XML that a tree file must not use; `line` counts from 1."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


@dataclass
class Element:
    """One XML element: its tag, attributes in file order, the line where it opens, and its children."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list["Element"] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The `name` attribute, '' where there is none."""
        return self.attributes.get("name", "")

    def walk(self) -> Iterator["Element"]:
        """This element and all below it, in file order."""
        yield self
        for child in self.children:
            yield from child.walk()


def key_of(value: str) -> str | None:
    """The key's name in a `{key}` reference, None for a literal.

    Raises:
        ValueError: braces that do not make a reference.
    """
    if match := _KEY.fullmatch(value):
        return match[1]
    if "{" in value or "}" in value:
        raise ValueError(f"{value!r} is neither a literal nor a {{key}}")
    return None


def read_elements(path: Path) -> Element:
    """Read a tree file.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: not well-formed, nested deeper than `MAX_DEPTH`, or with a document type (it could name
            entities, which may reach outside the file or grow without bound).
    """
    content = path.read_bytes()
    top = Element("", {}, 0)
    open_elements = [top]
    parser = expat.ParserCreate(namespace_separator=" ")

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)
        if len(open_elements) > MAX_DEPTH:
            raise TreeSyntaxError(element.line, f"elements nested deeper than {MAX_DEPTH}")

    def end(_tag: str) -> None:
        open_elements.pop()

    def refuse_doctype(*_declaration: object) -> None:
        raise TreeSyntaxError(parser.CurrentLineNumber, "a tree file must not have a document type")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise TreeSyntaxError(error.lineno, f"malformed XML: {expat.ErrorString(error.code)}") from error
    except LookupError as error:  # an encoding that Python does not know
        raise TreeSyntaxError(1, f"malformed XML: {error}") from error
    return top.children[0]
