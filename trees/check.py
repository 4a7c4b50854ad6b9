"""Checks a tree file before it runs, and finds everything that is wrong with it.

py_trees' own parser stops at the first error, gives no line numbers, and accepts much that is wrong: memory that is not
stated, unknown attributes, empty composites, ports without a value.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from itertools import chain, islice
from pathlib import Path

from regrasp.interfaces.quote import cut, quoted
from regrasp.trees.element import Element, TreeSyntaxError, key_of, read_elements
from regrasp.trees.flow import check_flow
from regrasp.trees.leaf_sets import check_task, installed_leaves, not_imported
from regrasp.trees.vocabulary import COUNTERPARTS, CellNames, ElementKind, element_kinds, suggestion
from regrasp.trees.wiring import ExpandedTree, TreeTooLarge

TreeFinding = tuple[int, str]  # line from 1 (0: the file itself), "what is wrong; what would be right"

_NAME = re.compile(r"[\w-]+")


def check_tree(
    path: Path,
    leaves: Mapping[str, type] | None = None,
    names: CellNames | None = None,
    max_findings: int = 500,
    task: str | None = None,
) -> list[TreeFinding]:
    """All findings, in line order, at most `max_findings`; a file without findings loads.

    `leaves` maps a tag to its class, by default those that are installed. `names` holds, for each kind of object in the
    cell, the names that a port may take, {"shelf": ["upper", ...]}; without it names are not checked. `task` is the
    scenario's; without it the tree's leaves must be of one task.

    Raises:
        TypeError: a leaf class without ports.
    """
    try:
        root = read_elements(path)
    except OSError as error:
        return [(0, f"cannot be read: {error.strerror}; name a file that can")]
    except TreeSyntaxError as error:
        return [(error.line, str(error))]
    if leaves is None:
        leaves = installed_leaves(root, task)
    findings = chain(_findings(root, element_kinds(leaves, names), leaves), check_task(root, leaves, task))
    return sorted(set(islice(findings, max_findings)))


def _findings(root: Element, known: Mapping[str, ElementKind], leaves: Mapping[str, type]) -> Iterator[TreeFinding]:
    given = [tree for tree in root.children if tree.tag == "BehaviorTree"]
    trees = {tree.attributes["ID"]: tree for tree in given if tree.attributes.get("ID")}
    keys = {identifier: _keys_used(tree) for identifier, tree in trees.items()}
    yield from _check_document(root, trees)
    for tree in given:
        yield from _check_names(tree)
        for element in tree.walk():
            if element is not tree:
                yield from _check_element(element, known, keys, leaves)
    yield from _never_run(root, trees)
    loops = [*_loops(trees)]
    yield from loops
    try:
        yield from check_runs(root, trees, known)
    except TreeTooLarge as error:
        if not loops:  # expanding a loop has no end
            yield root.line, str(error)


def check_runs(root: Element, trees: Mapping[str, Element], known: Mapping[str, ElementKind]) -> list[TreeFinding]:
    """Findings in the tree that will run, its subtrees expanded. Raises TreeTooLarge.

    `trees` are the BehaviorTree elements under `root` by ID, `known` the kinds of elements by tag.
    """
    main = trees.get(root.attributes.get("main_tree_to_execute", ""))
    if main is None:
        return []
    expanded = ExpandedTree(main, trees, known)
    return [*expanded.findings, *check_flow(expanded.root, known)]


def unknown(what: str, word: str, known: Collection[str]) -> str:
    """A message about an unknown word, with the nearest known one."""
    return f"unknown {what} {quoted(word)}; {suggestion(word, known)}"


def _check_document(root: Element, trees: Mapping[str, Element]) -> Iterator[TreeFinding]:
    if root.tag != "root":
        yield root.line, f"the outermost element is <{cut(root.tag)}>; write <root>"
    for attribute in root.attributes.keys() - {"main_tree_to_execute"}:
        yield root.line, unknown("attribute of root", attribute, ["main_tree_to_execute"])
    main = root.attributes.get("main_tree_to_execute")
    if not main:
        yield root.line, "root does not state main_tree_to_execute; write the ID of the tree to run"
    elif main not in trees:
        right = suggestion(main, trees) if trees else "write a BehaviorTree with this ID"
        yield root.line, f"unknown main tree {quoted(main)}; {right}"
    for tree in root.children:
        if tree.tag in ("Include", "Import"):
            yield tree.line, f"{tree.tag} is refused, a tree is one file; copy the BehaviorTree into this one"
            continue
        if tree.tag != "BehaviorTree":
            yield tree.line, unknown("element under root", tree.tag, ["BehaviorTree"])
            continue
        if not tree.attributes.get("ID"):
            yield (
                tree.line,
                'BehaviorTree has no ID; write ID="..."',
            )
        elif trees[tree.attributes["ID"]] is not tree:  # the mapping keeps the last
            yield tree.line, f"BehaviorTree ID {quoted(tree.attributes['ID'])} is given twice; rename one"
        if len(tree.children) != 1:
            yield tree.line, f"BehaviorTree has {len(tree.children)} children; give it one, such as a Sequence"
        for attribute, value in tree.attributes.items():
            if attribute != "ID":
                yield from _check_key(tree, attribute, value)
                if attribute not in (used := _keys_used(tree)):
                    yield tree.line, unknown("default of a key", attribute, used)


def _check_names(tree: Element) -> Iterator[TreeFinding]:
    namespaces = set()
    for parent in tree.walk():
        seen = set()
        for element in parent.children:
            if not _NAME.fullmatch(element.name):
                has = f"the name {quoted(element.name)}" if element.name else "no name"
                yield element.line, f"{element.tag} has {has}; give it one of letters, digits, _ and -"
            elif element.name in seen:
                yield element.line, f"the name {quoted(element.name)} is taken by a sibling; rename one"
            elif element.tag == "SubTree" and element.name in namespaces:
                yield (
                    element.line,
                    f"another SubTree here is named {quoted(element.name)}: they would share their keys; rename one",
                )
            seen.add(element.name)
            if element.tag == "SubTree":
                namespaces.add(element.name)


def _check_element(
    element: Element, known: Mapping[str, ElementKind], keys: Mapping[str, set[str]], leaves: Mapping[str, type]
) -> Iterator[TreeFinding]:
    if element.tag == "SubTree":
        yield from _check_subtree(element, keys)
        return
    if element.tag not in known:
        if right := COUNTERPARTS.get(element.tag):
            yield element.line, f"unknown element {quoted(element.tag)}; write {right}"
        else:
            right = suggestion(element.tag, [*known, "SubTree"])
            yield element.line, f"unknown element {quoted(element.tag)}{not_imported(leaves)}; {right}"
        return
    kind = known[element.tag]
    if len(element.children) < kind.min_children:
        yield element.line, f"{element.label} has no child; put one inside, or remove it"
    elif kind.max_children is not None and len(element.children) > kind.max_children:
        takes, where = ("no children", "out of it") if kind.max_children == 0 else ("one child", "into a Sequence")
        yield element.line, f"{element.label} takes {takes} and has {len(element.children)}; move them {where}"
    for name, attribute in kind.attributes.items():
        if attribute.required and name not in element.attributes:
            yield element.line, f'{element.label} does not state {name}; write {name}="..." ({attribute.takes})'
    for name, value in element.attributes.items():
        if name != "name":
            yield from _check_attribute(element, kind, name, value)


def _check_attribute(element: Element, kind: ElementKind, name: str, value: str) -> Iterator[TreeFinding]:
    if name not in kind.attributes:
        yield element.line, unknown(f"attribute of {element.tag}", name, [*kind.attributes, "name"])
        return
    attribute = kind.attributes[name]
    try:
        is_key = key_of(value) is not None and attribute.takes_key
    except ValueError as error:
        yield element.line, f"{element.label}: {cut(name)} {error}"
        return
    if attribute.is_output and not is_key:
        yield element.line, f"{element.label}: {name}={quoted(value)} is an output; wire it to a {{key}}"
    elif not is_key and (problem := attribute.problem(value)):
        yield element.line, f"{element.label}: {name}={quoted(value)} {problem}"


def _check_subtree(element: Element, keys: Mapping[str, set[str]]) -> Iterator[TreeFinding]:
    if element.children:
        yield element.line, f"{element.label} takes no children and has {len(element.children)}; move them out of it"
    identifier = element.attributes.get("ID", "")
    if not identifier:
        yield element.line, f'{element.label} has no ID; write ID="..." of the BehaviorTree to put here'
        return
    if identifier not in keys:
        yield element.line, unknown("subtree", identifier, keys)
        return
    for name, value in element.attributes.items():
        if name not in ("ID", "name"):
            yield from _check_key(element, name, value)
            if name not in keys[identifier]:
                yield element.line, unknown(f"key of subtree {cut(identifier)}", name, keys[identifier])


def _check_key(element: Element, name: str, value: str) -> Iterator[TreeFinding]:
    try:
        key_of(value)
    except ValueError as error:
        yield element.line, f"{element.label}: {cut(name)} {error}"


def _keys_used(tree: Element) -> set[str]:
    values = [value for element in tree.walk() if element is not tree for value in element.attributes.values()]
    return {value[1:-1] for value in values if value.startswith("{") and value.endswith("}")}


def _never_run(root: Element, trees: Mapping[str, Element]) -> Iterator[TreeFinding]:
    main = root.attributes.get("main_tree_to_execute", "")
    run: set[str] = set()
    todo = [main]
    while todo:
        if (identifier := todo.pop()) in trees and identifier not in run:
            run.add(identifier)
            todo += [element.attributes.get("ID", "") for element in _subtrees(trees[identifier])]
    for identifier, tree in trees.items():
        if main in trees and identifier not in run:
            yield tree.line, f"BehaviorTree {quoted(identifier)} is never run; include it with a SubTree, or remove it"


def _loops(trees: Mapping[str, Element]) -> Iterator[TreeFinding]:
    """SubTree elements that include a tree in itself (depth-first search)."""
    done: set[str] = set()
    for first in trees:
        branch = (
            {} if first in done else {first: _subtrees(trees[first])}
        )  # open trees, each with the SubTree elements still to follow
        while branch:
            current = next(reversed(branch))
            element = next(branch[current], None)
            identifier = element.attributes.get("ID", "") if element else ""
            if element is None:
                done.add(current)
                del branch[current]
            elif identifier in branch:
                yield element.line, f"subtree {quoted(identifier)} includes itself here; remove this SubTree"
            elif identifier in trees and identifier not in done:
                branch[identifier] = _subtrees(trees[identifier])


def _subtrees(tree: Element) -> Iterator[Element]:
    return (element for element in tree.walk() if element.tag == "SubTree")
