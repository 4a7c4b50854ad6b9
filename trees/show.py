"""A tree file as text to look at."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from trees.element import Element, read_elements


def show_tree(path: Path) -> str:
    """The tree with its subtrees filled in, a line a node: name, type, memory or policy, ports. Needs no leaf classes.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: it is not well-formed.
    """
    root = read_elements(path)
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children}
    main = root.attributes.get("main_tree_to_execute", "")
    return "\n".join(_lines(trees[main], trees, (main,), "", top=True)) if main in trees else f"no tree {main!r}"


def _lines(
    parent: Element, trees: Mapping[str, Element], opened: tuple[str, ...], indent: str, top: bool = False
) -> Iterator[str]:
    for child in parent.children:
        is_last = child is parent.children[-1]
        fork, rail = ("", "") if top else ("└─ ", "   ") if is_last else ("├─ ", "│  ")
        identifier = child.attributes.get("ID", "")
        inner, note = child, ""
        if child.tag == "SubTree":
            inner, note = _subtree(identifier, trees, opened)
        yield f"{indent}{fork}{_label(child)}{note}"
        yield from _lines(inner, trees, (*opened, identifier), indent + rail)


def _subtree(identifier: str, trees: Mapping[str, Element], opened: tuple[str, ...]) -> tuple[Element, str]:
    """What stands in a subtree's place, and a remark where nothing can."""
    if identifier in opened:
        return Element("", {}, 0), "  (includes itself)"
    if identifier not in trees:
        return Element("", {}, 0), "  (missing)"
    return trees[identifier], ""


def _label(element: Element) -> str:
    words = {"true": "with memory", "false": "reactive"}
    parts = [element.name, f" {element.tag}"]
    for name, value in element.attributes.items():
        if name == "memory":
            parts.append(words.get(value, f"memory={value}"))
        elif name in ("ID", "policy"):
            parts.append(value)
        elif name != "name":
            parts.append(f"{name}={value}")
    return " ".join(parts)
