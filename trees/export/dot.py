"""A tree in Graphviz' DOT language."""

from collections.abc import Iterator, Mapping

from regrasp.trees.export.labels import details, heading, identifiers, links, tooltip
from regrasp.trees.export.themes import Theme, colour_of
from regrasp.trees.graph import Node


def to_dot(root: Node, theme: Theme) -> str:
    """A digraph from left to right; subtrees are clusters, colours are the theme's."""
    ids = identifiers(root)
    head = [
        f"digraph {_quoted(root.name)} {{",
        f'  rankdir=LR; bgcolor="{theme.background}"; fontname="Helvetica"; fontcolor="{theme.text}";',
        f'  node [shape=box, style="rounded,filled", fillcolor="{theme.surface}", fontcolor="{theme.text}",'
        ' fontname="Helvetica", fontsize=11];',
        f'  edge [arrowhead=none, color="{theme.line}"];',
    ]
    # Links come last: one inside a cluster would draw both its ends into the cluster.
    edges = [f"  {ids[a.path]} -> {ids[b.path]}{_failed_style(a.failed and b.failed, theme)};" for a, b in links(root)]
    return "\n".join([*head, *_nodes(root, ids, theme, "  "), *edges, "}"])


def _nodes(node: Node, ids: Mapping[str, str], theme: Theme, indent: str) -> Iterator[str]:
    label = _quoted("\n".join([heading(node), *details(node)]))
    hint = _quoted(tooltip(node))
    colour = colour_of(node, theme)
    inner = indent
    if is_cluster := node.kind == "subtree" and bool(node.children):
        inner += "  "
        yield f"{indent}subgraph cluster_{ids[node.path]} {{"
        yield f'{inner}label={label}; tooltip={hint}; style="rounded,filled"; fillcolor="{theme.frame}";'
        yield f'{inner}color="{colour}"; fontsize=11; labeljust=l;'
    else:
        wide = ", penwidth=2" if node.failed else ""
        yield f'{indent}{ids[node.path]} [label={label}, tooltip={hint}, color="{colour}"{wide}];'
    for child in node.children:
        yield from _nodes(child, ids, theme, inner)
    if is_cluster:
        yield f"{indent}}}"


def _failed_style(failed: bool, theme: Theme) -> str:
    return f' [color="{theme.failed}", penwidth=2]' if failed else ""


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
