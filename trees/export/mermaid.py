"""A tree as a Mermaid flowchart, which GitHub and GitLab draw inside Markdown."""

from collections.abc import Iterator, Mapping

from regrasp.trees.export.labels import details, heading, identifiers, links
from regrasp.trees.export.themes import THEMES
from regrasp.trees.graph import Node, NodeKind

_SHAPES: dict[NodeKind, tuple[str, str]] = {"decorator": ("{{", "}}"), "action": ("(", ")"), "condition": ("([", "])")}
_LIGHT = THEMES["light"]  # every node brings its colours, so that it is read on a dark page too
_CODES = {'"': "#quot;", "#": "#35;", "&": "#amp;", "<": "#lt;", ">": "#gt;", "`": "#96;", "\\": "#92;", "\n": "<br/>"}


def to_mermaid(root: Node) -> str:
    """A flowchart from left to right; subtrees are subgraphs."""
    ids = identifiers(root)
    used = {_class(node) for node in root.walk()}
    classes = [f"  classDef {name} {style}" for name, style in _styles().items() if name in used]
    # A link inside a subgraph would draw both its ends into it.
    pairs = [f"  {ids[a.path]} --> {ids[b.path]}" for a, b in links(root)]
    return "\n".join(["flowchart LR", *classes, *_nodes(root, ids, "  "), *pairs])


def _class(node: Node) -> str:
    return "failed" if node.failed else "unvisited" if node.unvisited else node.kind


def _styles() -> dict[str, str]:
    plain = f"fill:{_LIGHT.surface},color:{_LIGHT.text}"
    return {
        **{kind: f"{plain},stroke:{colour}" for kind, colour in _LIGHT.kinds.items()},
        "failed": f"fill:{_LIGHT.failed_surface},color:{_LIGHT.text},stroke:{_LIGHT.failed},stroke-width:3px",
        "unvisited": f"fill:{_LIGHT.surface},color:{_LIGHT.muted},stroke:{_LIGHT.line}",
    }


def _nodes(node: Node, ids: Mapping[str, str], indent: str) -> Iterator[str]:
    own, label = ids[node.path], _escaped("\n".join([heading(node), *details(node)]))
    inner = indent
    if is_subgraph := node.kind == "subtree" and bool(node.children):
        inner += "  "
        yield f'{indent}subgraph {own}["{label}"]'
    else:
        before, after = _SHAPES.get(node.kind, ("[", "]"))
        yield f'{indent}{own}{before}"{label}"{after}:::{_class(node)}'
    for child in node.children:
        yield from _nodes(child, ids, inner)
    if is_subgraph:
        yield f"{indent}end"
        yield f"{indent}class {own} {_class(node)}"


def _escaped(text: str) -> str:
    return "".join(_CODES.get(char, char) for char in text)
