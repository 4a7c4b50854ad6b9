"""Reads a tree file into plain elements that know their line."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.parsers.expat import errors

from regrasp.interfaces.quote import cut, quoted

MAX_ELEMENT_DEPTH = 60  # nested elements; the parser that builds the tree is recursive
_KEY = re.compile(r"\{([A-Za-z_]\w*)\}")

_REMEDIES = {
    errors.XML_ERROR_INVALID_TOKEN: "write & as &amp;, < as &lt;, and every value in quotes",
    errors.XML_ERROR_DUPLICATE_ATTRIBUTE: "give each attribute once",
    errors.XML_ERROR_UNDEFINED_ENTITY: "there are &amp; &lt; &gt; &quot; &apos; only",
    errors.XML_ERROR_UNBOUND_PREFIX: "write the tag without a prefix",
    errors.XML_ERROR_UNKNOWN_ENCODING: "save the file as UTF-8",
    errors.XML_ERROR_INCORRECT_ENCODING: "save the file as UTF-8",
}


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
    def label(self) -> str:
        """How messages name the element: Wait 'watch'."""
        return f"{cut(self.tag)} {quoted(self.name)}"

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
        wrong = f"{quoted(value)} is neither a literal nor a {{key}}"
        raise ValueError(f"{wrong}; write braces around one whole word, or none")
    return None


def read_elements(path: Path) -> Element:
    """Read a tree file.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: not well-formed, nested deeper than `MAX_ELEMENT_DEPTH`, or with a document type (it could name
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
        if len(open_elements) > MAX_ELEMENT_DEPTH:
            raise TreeSyntaxError(
                element.line, f"elements nested deeper than {MAX_ELEMENT_DEPTH}; move some into a BehaviorTree"
            )

    def end(_tag: str) -> None:
        open_elements.pop()

    def refuse_doctype(*_declaration: object) -> None:
        raise TreeSyntaxError(parser.CurrentLineNumber, "a document type is refused; remove <!DOCTYPE ...>")

    def text(content: str) -> None:
        if word := content.strip():
            raise TreeSyntaxError(parser.CurrentLineNumber, f"stray text {quoted(word)}; put it in a <!-- comment -->")

    parser.CharacterDataHandler = text
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        fault = expat.ErrorString(error.code)
        raise TreeSyntaxError(error.lineno, f"malformed XML: {fault}; {_remedy(fault, open_elements)}") from error
    except LookupError as error:  # an encoding that Python does not know
        raise TreeSyntaxError(1, f"malformed XML: {error}; save the file as UTF-8") from error
    return top.children[0]


def _remedy(fault: str, open_elements: list[Element]) -> str:
    """What would be right in place of expat's error `fault`."""
    if fault in _REMEDIES:
        return _REMEDIES[fault]
    inner = open_elements[-1]
    if not inner.tag:
        return "write one <root> with everything inside it"
    return f"close <{cut(inner.tag)}> of line {inner.line}"
