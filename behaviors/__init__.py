"""Leaves of the behaviour trees (py_trees), and our own decorators. A tree file may name the `LEAVES`."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from regrasp.behaviors.leaf import Leaf as Leaf

    LEAVES: dict[str, type[Any]]

__all__ = ["LEAVES", "Leaf"]


def __getattr__(name: str) -> Any:
    if name == "LEAVES":
        from regrasp.behaviors.registry import all_leaves  # late: it imports the leaves of every task

        return all_leaves()
    if name == "Leaf":
        from regrasp.behaviors.leaf import Leaf

        return Leaf
    raise AttributeError(f"module 'regrasp.behaviors' has no attribute {name!r}")
