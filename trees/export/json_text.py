"""A tree as JSON for other programs.

{"schema": 1, "tree": NODE}, where NODE holds, always in this order:
  path      as in ticks.jsonl
  name, type  as in the tree file: own name, element
  kind      sequence, fallback, parallel, decorator, action, condition or subtree
  memory    true, false, or null where it has no meaning
  policy    of a Parallel or OneShot, else ""
  ports     [{name, value, constant, direction, type, default}]: value as written or null, constant its literal
            value or null, direction input, output or inout
  tree      ID of the tree that it is written in
  subtree   ID of a SubTree's tree, else ""
  hidden    number of nodes below that --depth leaves out
  run       null, or of a recorded run {visits, successes, failures, stopped, running_seconds, last}; seconds simulated
  failed    whether it lies on the path by which the run failed
  children  [NODE]; of a SubTree the top node of its tree
"""

import json
from dataclasses import asdict
from typing import Any

from regrasp.trees.graph import Node


def to_json(root: Node) -> str:
    """The tree in the form above."""
    return json.dumps({"schema": 1, "tree": _plain(root)}, indent=2, ensure_ascii=False)


def _plain(node: Node) -> dict[str, Any]:
    run = asdict(node.stats) | {"running_seconds": round(node.stats.running_seconds, 6)} if node.stats else None
    return {
        "path": node.path,
        "name": node.name,
        "type": node.type,
        "kind": node.kind,
        "memory": node.memory,
        "policy": node.policy,
        "ports": [asdict(port) for port in node.ports],
        "tree": node.tree,
        "subtree": node.subtree,
        "hidden": node.hidden,
        "run": run,
        "failed": node.failed,
        "children": [_plain(child) for child in node.children],
    }
