"""What is wrong with the elements of a URDF, before frames are worked out of them.

https://wiki.ros.org/urdf/XML
"""

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator

from regrasp.interfaces.quote import nearest, quoted

DRIVEN = ("revolute", "continuous", "prismatic")  # kinds of joints that a motor can move
_KINDS = (*DRIVEN, "fixed", "floating", "planar")
_COUNTS = {  # of the numbers in each attribute, by element
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "velocity": 1, "effort": 1},
    "mimic": {"multiplier": 1, "offset": 1},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "box": {"size": 3},
    "cylinder": {"radius": 1, "length": 1},
    "sphere": {"radius": 1},
}


def problem_of(root: ET.Element) -> str | None:
    """The first thing that is wrong, in words; None if nothing is."""
    return next(_problems(root), None)


def _problems(root: ET.Element) -> Iterator[str]:
    """Each may rely on those before it."""
    if root.tag != "robot":
        yield f"its root element is <{root.tag}>, not <robot>; name a URDF file"
    elif not root.findall("link"):
        yield "it has no <link>; name a URDF file of a robot"
    yield from _names(root)
    for owner in (*root.findall("link"), *root.findall("joint")):
        yield from _numbers(owner)
    for joint in root.findall("joint"):
        yield from _joint(joint, [str(link.get("name")) for link in root.findall("link")])
    yield from _mimics(root)
    yield from _tree(root)


def _names(root: ET.Element) -> Iterator[str]:
    for tag in ("link", "joint"):
        counts = Counter(element.get("name") for element in root.findall(tag))
        for name, count in counts.items():
            if not name:
                yield f"a {tag} has no name; give it one"
            elif count > 1:
                yield f"{count} {tag}s are named {quoted(name)}; give each a name of its own"


def _numbers(owner: ET.Element) -> Iterator[str]:
    who = f"{owner.tag} {quoted(owner.get('name'))}"
    for element in owner.iter():
        for key, count in _COUNTS.get(element.tag, {}).items():
            text = element.get(key)
            if text is not None and not _are_numbers(text, count):
                right = "a finite number" if count == 1 else f"{count} finite numbers"
                yield f"{who}: {element.tag} {key} is {quoted(text)}; write {right}"
            elif element.tag == "mass" and text is not None and float(text) < 0:
                yield f"{who}: mass value is {text}; write a positive one"


def _are_numbers(text: str, count: int) -> bool:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return False
    return len(values) == count and all(map(math.isfinite, values))


def _joint(joint: ET.Element, links: list[str]) -> Iterator[str]:
    who = f"joint {quoted(joint.get('name'))}"
    kind, axis = joint.get("type"), joint.find("axis")
    if kind not in _KINDS:
        yield f"{who}: no type {quoted(kind)}; {nearest(str(kind), _KINDS)}"
    for tag in ("parent", "child"):
        element = joint.find(tag)
        link = None if element is None else element.get("link")
        if link is None:
            yield f'{who}: its {tag} is missing; write <{tag} link="..."/>'
        elif link not in links:
            yield f"{who}: its {tag} is {quoted(link)}, and there is no such link; {nearest(link, links)}"
    if kind in DRIVEN and axis is not None and not any(map(float, axis.get("xyz", "1 0 0").split())):
        yield f"{who}: axis xyz is zero; write the direction in which it moves"


def _mimics(root: ET.Element) -> Iterator[str]:
    names = [str(joint.get("name")) for joint in root.findall("joint")]
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and mimic.get("joint") not in names:
            other = str(mimic.get("joint"))
            yield f"joint {quoted(joint.get('name'))}: it mimics {quoted(other)}; {nearest(other, names)}"


def _tree(root: ET.Element) -> Iterator[str]:
    """Whether the joints make one tree of the links."""
    above: dict[str, tuple[str, str]] = {}  # joint and parent by child
    for joint in root.findall("joint"):
        parent, child = (_link(joint, tag) for tag in ("parent", "child"))
        if child in above:
            others = f"{quoted(above[child][0])} and {quoted(joint.get('name'))}"
            yield f"link {quoted(child)} is the child of two joints, {others}; a link hangs on one"
        above[child] = str(joint.get("name")), parent
    for link in above:
        if circle := _circle(link, above):
            yield f"the joints of the URDF go round in a circle: {', '.join(circle)}; let one link be no joint's child"
    roots = [name for link in root.findall("link") if (name := str(link.get("name"))) not in above]
    if len(roots) > 1:
        yield f"no joint carries the links {', '.join(map(quoted, roots))}; fix all but one to another link"


def _link(joint: ET.Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else str(element.get("link"))


def _circle(link: str, above: dict[str, tuple[str, str]]) -> list[str]:
    """The joints over a link if they come back to it, the first one last; else none."""
    joints, seen, here = [], set[str](), link
    while here in above and here not in seen:
        seen.add(here)
        joint, here = above[here]
        joints.append(joint)
    return joints[::-1] if here == link else []
