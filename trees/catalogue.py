"""Every leaf and built-in element of tree files with its attributes, as text."""

from collections.abc import Iterator, Mapping

from regrasp.behaviors.keys import CAUSES
from regrasp.trees.vocabulary import BUILT_IN, Attribute, ElementKind, element_kinds

_SUBTREE = ElementKind(
    {"ID": Attribute(str, about="the BehaviorTree to put here; every other attribute sets a key of it")},
    about="Another BehaviorTree of the file, with keys of its own.",
)


def all_elements(leaves: Mapping[str, type]) -> dict[str, ElementKind]:
    """Every element that a tree may hold: the leaves, then the built-in ones."""
    known = element_kinds(leaves)
    return {tag: known[tag] for tag in leaves} | BUILT_IN | {"SubTree": _SUBTREE}


def describe(tag: str, kind: ElementKind, full: bool = False) -> Iterator[str]:
    """Lines: the element with the first line of what it does (or all of it), then each attribute and declared key."""
    about = kind.about.splitlines() or [""]
    yield f"{tag:<18} {about[0]}".rstrip()
    if full:
        yield from (f"{'':<18} {line}".rstrip() for line in about[1:])
        yield f"    {'returns':<14} {', '.join(sorted(status.value.lower() for status in kind.returns))}"
    for name, attribute in kind.attributes.items():
        yield f"    {name:<14} {_attribute(attribute)}"
    for use, keys in (("needs", kind.needs), ("reads", kind.reads), ("writes", kind.writes), ("clears", kind.clears)):
        yield from (f"    {key.name:<14} {use}: {key.about}" for key in keys if key is not CAUSES)  # any leaf's


def _attribute(attribute: Attribute) -> str:
    direction = "output" if attribute.is_output else "input" if attribute.is_port else "constant"
    need = "" if attribute.is_output else "required" if attribute.default is None else f"default {attribute.default}"
    about = f": {attribute.about}" if attribute.about else ""
    return ", ".join(part for part in (direction, attribute.takes, need) if part) + about
