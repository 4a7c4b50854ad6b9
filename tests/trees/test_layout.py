from itertools import combinations

from hypothesis import given
from random_nodes import nodes

from regrasp.trees import Node
from regrasp.trees.export.layout import NodeBox, Spacing, lay_out

SIZES = {"sequence": (60.0, 26.0), "decorator": (180.0, 40.0), "condition": (20.0, 80.0), "subtree": (300.0, 27.0)}


def place(node: Node) -> list[NodeBox]:
    return list(lay_out(node, lambda n: SIZES.get(n.kind, (110.0, 26.0))).walk())


def overlap(a: NodeBox, b: NodeBox) -> bool:
    return a.x < b.right and b.x < a.right and a.y < b.bottom and b.y < a.bottom


def inside(a: NodeBox, b: NodeBox) -> bool:
    return b.x < a.x and a.right < b.right and b.y < a.y and a.bottom < b.bottom


@given(nodes)
def test_no_two_boxes_overlap_unless_one_is_the_frame_round_the_other(node: Node) -> None:
    boxes = place(node)
    assert len(boxes) == sum(1 for _ in node.walk())
    for a, b in combinations(boxes, 2):
        framed = a.is_frame and any(b is c for c in a.walk())
        assert inside(b, a) if framed else not overlap(a, b), (a, b)


@given(nodes)
def test_children_stand_right_of_their_parent_from_top_to_bottom_with_it_at_their_middle(node: Node) -> None:
    for box in place(node):
        if box.children and not box.is_frame:
            middles = [child.middle for child in box.children]
            assert middles == sorted(middles)
            assert all(child.x == box.right + Spacing.gap_x for child in box.children)
            assert abs(box.y + box.height / 2 - (middles[0] + middles[-1]) / 2) < 1e-6


@given(nodes)
def test_links_cross_no_box(node: Node) -> None:
    boxes = place(node)
    for parent in boxes:
        if parent.children and not parent.is_frame:
            first, last = parent.children[0], parent.children[-1]
            room = NodeBox(node, parent.right + 0.01, first.middle, Spacing.gap_x - 0.02, last.middle - first.middle)
            assert not any(overlap(room, box) for box in boxes if not box.is_frame or box in parent.children)


def test_a_tree_of_2000_nodes_is_placed() -> None:
    leaf = Node("leaf", "leaf", "Some", "action")
    layer = Node("layer", "layer", "Sequence", "sequence", children=(leaf,) * 18)
    assert len(place(Node("root", "root", "Sequence", "sequence", children=(layer,) * 105))) == 105 * 19 + 1
