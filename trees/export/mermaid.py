"""A tree as a Mermaid flowchart, which GitHub and GitLab draw inside Markdown."""

from collections.abc import Iterator, Mapping

from trees.export.labels import details, heading, identifiers, links
from trees.export.themes import THEMES
from trees.graph import Kind, Node

_SHAPES: dict[Kind, tuple[str, str]] = {"decorator": ("{{", "}}"), "action": ("(", ")"), "condition": ("([", "])")}
_LIGHT = THEMES["light"]  # every node brings its colours, so that it is read on a dark page too
_CODES = {'"': "#quot;", "#": "#35;", "&": "#amp;", "<": "#lt;", ">": "#gt;", "`": "#96;", "\\": "#92;", "\n": "<br/>"}


def to_mermaid(root: Node) -> str:
    """A flowchart from left to right; subtrees are subgraphs."""
    ids = identifiers(root)
    used = {node.kind for node in root.walk()}
    classes = [
        f"  classDef {kind} fill:{_LIGHT.surface},stroke:{colour},color:{_LIGHT.text}"
        for kind, colour in _LIGHT.kinds.items()
        if kind in used
    ]
    if root.failed:
        fill, line = _LIGHT.failed_surface, _LIGHT.failed
        classes.append(f"  classDef failed fill:{fill},stroke:{line},color:{_LIGHT.text},stroke-width:3px")
    # A link inside a subgraph would draw both its ends into it.
    pairs = [f"  {ids[a.path]} --> {ids[b.path]}" for a, b in links(root)]
    return "\n".join(["flowchart LR", *classes, *_nodes(root, ids, "  "), *pairs])


def _nodes(node: Node, ids: Mapping[str, str], indent: str) -> Iterator[str]:
    own, label = ids[node.path], _escaped("\n".join([heading(node), *details(node)]))
    inner = indent
    if is_subgraph := node.kind == "subtree" and bool(node.children):
        inner += "  "
        yield f'{indent}subgraph {own}["{label}"]'
    else:
        before, after = _SHAPES.get(node.kind, ("[", "]"))
        yield f'{indent}{own}{before}"{label}"{after}:::{"failed" if node.failed else node.kind}'
    for child in node.children:
        yield from _nodes(child, ids, inner)
    if is_subgraph:
        yield f"{indent}end"
        yield f"{indent}class {own} {'failed' if node.failed else node.kind}"


def _escaped(text: str) -> str:
    return "".join(_CODES.get(char, char) for char in text)
