"""Everything wrong with a tree file, before it runs.

py_trees' own parser stops at the first error, has no line numbers and lets much pass: memory that is not stated, words
that it does not know, empty composites, ports without a value.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path

from trees.element import Element, TreeSyntaxError, key_of, read_elements
from trees.vocabulary import Kind, kinds
from trees.wiring import check_wiring

Finding = tuple[int, str]  # line from 1 (0: the file itself), sentence

_NAME = re.compile(r"[\w-]+")


def check_tree(path: Path, leaves: Mapping[str, type] | None = None) -> list[Finding]:
    """All findings, in line order; a file without any loads. `leaves` maps a tag to its class, by default all of ours.

    Raises:
        TypeError: a leaf class without ports.
    """
    if leaves is None:
        from behaviors import LEAVES  # late: they bring the planner, which a check with toy leaves does not need

        leaves = LEAVES
    try:
        root = read_elements(path)
    except OSError as error:
        return [(0, f"cannot be read: {error.strerror}")]
    except TreeSyntaxError as error:
        return [(error.line, str(error))]
    known = kinds(leaves)
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children if tree.tag == "BehaviorTree"}
    findings = [*_check_document(root, trees)]
    for tree in trees.values():
        findings += _check_names(tree)
        for element in tree.walk():
            if element is not tree:
                findings += _check_element(element, known, trees)
    loops = [*_loops(trees)]
    if not loops:  # wiring follows subtrees without end
        findings += check_wiring(root, trees, known)
    return sorted(set(findings + loops))


def unknown(what: str, word: str, known: Collection[str]) -> str:
    """The sentence about a word that is not known, with the nearest that is."""
    nearest = get_close_matches(word, known, 1, 0.5)
    hint = f"did you mean {nearest[0]}?" if nearest else f"there are {', '.join(sorted(known)) or 'none'}"
    return f"unknown {what} {word!r}; {hint}"


def _check_document(root: Element, trees: Mapping[str, Element]) -> Iterator[Finding]:
    if root.tag != "root":
        yield root.line, f"the outermost element must be <root>, not <{root.tag}>"
    for attribute in root.attributes.keys() - {"main_tree_to_execute"}:
        yield root.line, unknown("attribute of root", attribute, ["main_tree_to_execute"])
    main = root.attributes.get("main_tree_to_execute")
    if main is None:
        yield root.line, "root needs main_tree_to_execute, the ID of the tree to run"
    elif main not in trees:
        yield root.line, unknown("main tree", main, trees)
    for tree in root.children:
        if tree.tag != "BehaviorTree":
            yield tree.line, unknown("element under root", tree.tag, ["BehaviorTree"])
            continue
        if not tree.attributes.get("ID"):
            yield tree.line, "BehaviorTree needs an ID"
        elif trees[tree.attributes["ID"]] is not tree:  # the mapping keeps the last
            yield tree.line, f"BehaviorTree ID {tree.attributes['ID']!r} is given twice"
        if len(tree.children) != 1:
            yield tree.line, f"BehaviorTree must have one child, not {len(tree.children)}"
        keys = _keys_used(tree)
        for attribute, value in tree.attributes.items():
            if attribute != "ID":
                yield from _check_key(tree, attribute, value)
                if attribute not in keys:
                    yield tree.line, unknown("default of a key", attribute, keys)


def _check_names(tree: Element) -> Iterator[Finding]:
    namespaces = set()
    for parent in tree.walk():
        seen = set()
        for element in parent.children:
            if not _NAME.fullmatch(element.name):
                yield element.line, f"{element.tag} needs a name of letters, digits, _ and -, not {element.name!r}"
            elif element.name in seen:
                yield element.line, f"the name {element.name!r} is taken by a sibling"
            elif element.tag == "SubTree" and element.name in namespaces:
                yield element.line, f"another SubTree here is named {element.name!r}: they would share their keys"
            seen.add(element.name)
            if element.tag == "SubTree":
                namespaces.add(element.name)


def _check_element(element: Element, known: Mapping[str, Kind], trees: Mapping[str, Element]) -> Iterator[Finding]:
    if element.tag == "SubTree":
        yield from _check_subtree(element, trees)
        return
    if element.tag not in known:
        yield element.line, unknown("element", element.tag, [*known, "SubTree"])
        return
    kind = known[element.tag]
    if len(element.children) < kind.min_children:
        yield element.line, f"{element.tag} {element.name!r} needs a child"
    elif kind.max_children is not None and len(element.children) > kind.max_children:
        limit = "no children" if kind.max_children == 0 else "one child"
        yield element.line, f"{element.tag} {element.name!r} takes {limit}, not {len(element.children)}"
    for name, attribute in kind.attributes.items():
        if attribute.required and name not in element.attributes:
            yield element.line, f"{element.tag} {element.name!r} does not state {name}"
    for name, value in element.attributes.items():
        if name != "name":
            yield from _check_attribute(element, kind, name, value)


def _check_attribute(element: Element, kind: Kind, name: str, value: str) -> Iterator[Finding]:
    if name not in kind.attributes:
        yield element.line, unknown(f"attribute of {element.tag}", name, [*kind.attributes, "name"])
        return
    attribute = kind.attributes[name]
    try:
        is_key = key_of(value) is not None and attribute.takes_key
    except ValueError as error:
        yield element.line, f"{element.tag} {element.name!r}: {name} {error}"
        return
    if attribute.is_output and not is_key:
        yield element.line, f"{element.tag} {element.name!r}: {name} is an output and must be wired to a {{key}}"
    elif not is_key and (problem := attribute.problem(value)):
        yield element.line, f"{element.tag} {element.name!r}: {name}={value!r} {problem}"


def _check_subtree(element: Element, trees: Mapping[str, Element]) -> Iterator[Finding]:
    if element.children:
        yield element.line, f"SubTree {element.name!r} takes no children, not {len(element.children)}"
    identifier = element.attributes.get("ID", "")
    if identifier not in trees:
        yield element.line, unknown("subtree", identifier, trees)
        return
    keys = _keys_used(trees[identifier])
    for name, value in element.attributes.items():
        if name not in ("ID", "name"):
            yield from _check_key(element, name, value)
            if name not in keys:
                yield element.line, unknown(f"key of subtree {identifier}", name, keys)


def _check_key(element: Element, name: str, value: str) -> Iterator[Finding]:
    try:
        key_of(value)
    except ValueError as error:
        yield element.line, f"{element.tag} {element.name!r}: {name} {error}"


def _keys_used(tree: Element) -> set[str]:
    values = [value for element in tree.walk() if element is not tree for value in element.attributes.values()]
    return {value[1:-1] for value in values if value.startswith("{") and value.endswith("}")}


def _loops(trees: Mapping[str, Element]) -> Iterator[Finding]:
    """A finding at each SubTree element from which its own tree can be reached again."""
    includes = {
        identifier: {e.attributes.get("ID", "") for e in tree.walk() if e.tag == "SubTree"}
        for identifier, tree in trees.items()
    }

    def reachable(identifier: str) -> set[str]:
        found: set[str] = set()
        todo = [identifier]
        while todo:
            if (current := todo.pop()) not in found:
                found.add(current)
                todo += includes.get(current, ())
        return found

    for identifier, tree in trees.items():
        for element in tree.walk():
            if element.tag == "SubTree" and identifier in reachable(element.attributes.get("ID", "")):
                yield element.line, f"subtree {identifier!r} includes itself here"
