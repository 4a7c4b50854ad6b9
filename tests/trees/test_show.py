from pathlib import Path

from toy_leaves import GOOD

from regrasp.trees import show_tree


def test_a_tree_is_drawn_with_names_types_memory_and_ports(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text(GOOD)
    assert show_tree(tmp_path / "tree.xml").splitlines() == [
        "root  Sequence with memory",
        "├─ search  SubTree Search place={place} tries=2",
        "│  └─ again  Retry num_failures={tries}=2",
        "│     └─ either  Fallback without memory",
        "│        ├─ not_yet  Inverter",
        "│        │  └─ blink  Wait ticks=1",
        "│        └─ look  Look angle=0.25 camera={camera}=rear place={place}",
        "├─ carry  Parallel success_on_one",
        "│  ├─ watch  Wait ticks=99",
        "│  └─ move  Wait ticks=2",
        "└─ go  Go place={place}",
    ]


def test_a_tree_that_is_wrong_is_drawn_as_far_as_it_goes(tmp_path: Path) -> None:
    text = GOOD.replace('<Go name="go" place="{place}"/>', '<SubTree ID="Main" name="me"/><SubTree ID="No" name="no"/>')
    (tmp_path / "tree.xml").write_text(text)
    assert show_tree(tmp_path / "tree.xml").splitlines()[-2:] == [
        "├─ me  SubTree Main  (includes itself)",
        "└─ no  SubTree No  (missing)",
    ]
