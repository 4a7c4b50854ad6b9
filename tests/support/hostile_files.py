"""Files that no reader should have to see: known tricks, and mutated copies of our own."""

import json
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal, NamedTuple

from regrasp.app.files.resources import shipped

HOSTILE = (
    *(".nan", ".inf", "-.inf", "1e999", "1.0e+999", "-0.0", "9" * 400, "0x7fffffff", "010", "1_000", "1:30", "-1", "0"),
    *("true", "no", "null", "~", "''", "[]", "{}", "[[[[[]]]]]", "*a", "&a b", "<<: *a", "!!python/object:os.system x"),
    *(
        "../../../../etc/passwd",
        "/etc/passwd",
        "/dev/zero",
        "C:\\x",
        "a" * 5000,
        "\x00",
        "\x1b[2J",
        "\u202e",
        "\ud83d\ude00",
    ),
    *(
        "{tries}",
        "{",
        "}",
        "{{a}}",
        "&lol;",
        "<a/>",
        "<![CDATA[x]]>",
        "-->",
        "<?xml version='1.1'?>",
        "zero: [1, 2]",
        "%s%n",
    ),
)


RECORD = Path(__file__).parent / "record"  # of a run of ten seconds
SHIPPED: tuple[Literal["scenario", "cell", "tree"], ...] = ("scenario", "cell", "tree")
KINDS = (*SHIPPED, *(path.name for path in sorted(RECORD.iterdir())))


class Case(NamedTuple):
    """One file to read: its kind ("scenario", "cell", "tree", or its name in a record), its bytes, how it was made."""

    kind: str
    data: bytes
    made: str
    is_loop: bool = False  # in its place stands a link that leads back to itself


def cases(count: int, seed: int) -> Iterator[Case]:
    """The catalogue, then mutated copies of the shipped files and of a record's, `count` in all."""
    made = 0
    for case in catalogue(random.Random(seed)):
        if made < count:
            made += 1
            yield case
    ours = {name: [(RECORD / name).read_bytes()] for name in KINDS[len(SHIPPED) :]}
    for known in SHIPPED:
        ours[known] = [path.read_bytes() for path in shipped(known).values()]
    for number in range(count - made):
        rng = random.Random(f"{seed}/{number}")
        kind = rng.choice((*SHIPPED, *KINDS))
        data = rng.choice(ours[kind])
        names = [rng.choice(list(MUTATIONS)) for _ in range(rng.randint(1, 4))]
        if kind == "cell" and rng.random() < 0.5:
            names = ["huge number"] * rng.randint(1, 3)
        for name in names:
            data = MUTATIONS[name](rng, data)
        yield Case(kind, data, f"seed {seed} number {number}: {', '.join(names)}")


def catalogue(rng: random.Random) -> Iterator[Case]:
    """Tricks that are known by name, each as UTF-8 and in another encoding."""
    bomb = "\n".join(["a0: &a0 [x, x]", *(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60))])
    merges = "\n".join(
        ["m0: &m0 {x: 1}", *(f"m{i}: &m{i} {{<<: [*m{i - 1}, *m{i - 1}], k{i}: 1}}" for i in range(1, 40))]
    )
    texts = {
        "alias bomb": bomb,
        "merge bomb": merges,
        "alias of itself": "&a [*a]",
        "deep flow": "[" * 20_000,
        "deep block": "".join(" " * i + "a:\n" for i in range(400)),
        "long key": "? " + "k" * 100_000 + "\n: 1",
        "many documents": "---\na: 1\n" * 1000,
        "many keys": "\n".join(f"k{i}: {i}" for i in range(15_000)),
        "large": "a: " + "x" * 1_000_000,
        "empty": "",
        "only a comment": "# nothing",
        "a list": "- 1",
        "tag": "!!python/object/apply:os.system ['true']",
        "huge number": "gravity: " + "9" * 10_000,
        "escape beyond Unicode": 'a: "\\U00110000"',
        "endless fold": "a: >\n" + " x\n" * 50_000,
    }
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "lol"}">' for i in range(12))
    nested = "<Sequence name='s' memory='true'>"
    trees = {
        "entity bomb": f"<!DOCTYPE root [{entities}]><root>&e11;</root>",
        "outside entity": '<!DOCTYPE root [<!ENTITY x SYSTEM "file:///etc/passwd">]><root>&x;</root>',
        "outside type": '<!DOCTYPE root SYSTEM "http://localhost/x.dtd"><root/>',
        "deep": "<root>" + nested * 50_000,
        "include": _tree("").replace("</root>", '<Include path="/etc/passwd"/></root>'),
        "unknown encoding": '<?xml version="1.0" encoding="ebcdic-x"?><root/>',
        "many attributes": "<root " + " ".join(f'a{i}="1"' for i in range(20_000)) + "/>",
        "wide": _tree(f"{nested}{'<SafeStop/>' * 10_000}</Sequence>"),
        "doubling subtrees": doubling_subtrees(40),
        "subtree in itself": _tree('<SubTree ID="a" name="a"/>'),
    }
    for name, text in (texts | trees).items():
        kinds = ("tree",) if name in trees else ("scenario", "cell")
        for kind in kinds:
            for encoding in ("utf-8", rng.choice(("utf-16", "utf-32", "latin-1", "utf-8-sig"))):
                yield Case(kind, text.encode(encoding), f"{name} in {encoding}")
    for kind in KINDS:
        yield Case(kind, b"", "a link that leads back to itself", is_loop=True)
    for kind, tricks in record_tricks().items():
        for name, text in tricks.items():
            yield Case(kind, text.encode("utf-8", "surrogatepass"), name)


def record_tricks() -> dict[str, dict[str, str]]:
    """By the file of a record: what stands for its content, by name."""
    tick = {"t": 0.0, "path": "recovery", "status": "RUNNING"}
    paths = {
        "deep path": "a/" * 50_000,
        "empty path": "",
        "only slashes": "/" * 100,
        "steering path": "recovery/\x1b[2J\u202e\n",
        "lone surrogate": "\ud800",
        "long name": "a" * 100_000,
    }
    line = json.dumps(tick)
    ticks = {name: json.dumps(tick | {"path": path}) + "\n" for name, path in paths.items()} | {
        "many lines": f"{line}\n" * 20_000,
        "many nodes": "".join(json.dumps(tick | {"path": f"recovery/{i}"}) + "\n" for i in range(5_000)),
        "huge second": json.dumps(tick | {"t": 1e308}) + "\n",
        "blank lines": f"{line}\n\n\n{line}\n",
        "deep JSON": '{"t":' * 50_000,
        "key twice": '{"t": 0, "t": 1, "path": "a", "status": "RUNNING"}\n',
        "empty": "",
    }
    event = {"t": 0.0, "event": "failed", "node": "recovery", "code": "slipped", "message": "m"}
    events = {name: json.dumps(event | {"node": path}) + "\n" for name, path in paths.items()} | {
        "begin of other types": json.dumps({"t": 0.0, "event": "begin", "inputs": [1], "overrides": {}, "seed": []})
        + "\n",
        "inputs of other types": json.dumps({"t": 0.0, "event": "begin", "inputs": {"tries": [{}], "x": None}}) + "\n",
        "long message": json.dumps(event | {"message": "a b " * 100_000, "of": 7}) + "\n",
        "many values": json.dumps(event | {f"v{i}": i for i in range(10_000)}) + "\n",
        "no event": "",
    }
    result = json.loads((RECORD / "result.json").read_text(encoding="utf-8"))
    attempt = result["attempts"][0]
    results = {name: json.dumps(result | {"attempts": [attempt | {"path": path}]}) for name, path in paths.items()} | {
        "long chain": json.dumps(
            result | {"chain": [{"path": "a", "type": "b", "at": 0.0, "why": "c d " * 50}] * 2_000}
        ),
        "many attempts": json.dumps(result | {"attempts": [attempt] * 5_000}),
        "newer": json.dumps(result | {"schema": 10**30}),
        "deep": "[" * 50_000,
        "null": "null",
    }
    return {"ticks.jsonl": ticks, "events.jsonl": events, "result.json": results}


def doubling_subtrees(levels: int) -> str:
    """A tree file whose subtrees stand for 2**levels nodes."""
    more = "".join(
        f'<BehaviorTree ID="t{i}"><Sequence name="s" memory="true"><SubTree ID="t{i + 1}" name="a"/>'
        f'<SubTree ID="t{i + 1}" name="b"/></Sequence></BehaviorTree>'
        for i in range(levels)
    )
    last = f'<BehaviorTree ID="t{levels}"><SafeStop name="x"/></BehaviorTree>'
    return _tree('<SubTree ID="t0" name="t"/>').replace("</root>", more + last + "</root>")


def _tree(inside: str) -> str:
    return f'<root main_tree_to_execute="a"><BehaviorTree ID="a">{inside}</BehaviorTree></root>'


def _token(rng: random.Random, data: bytes) -> bytes:
    spans = [m.span() for m in re.finditer(rb"[\w.+-]+", data)] or [(0, 0)]
    first, last = rng.choice(spans)
    return data[:first] + rng.choice(HOSTILE).encode("utf-8", "surrogatepass") + data[last:]


def _huge(rng: random.Random, data: bytes) -> bytes:
    """One of the numbers, of whatever key, as large or as small as a float may be, or nearly so."""
    spans = [m.span() for m in re.finditer(rb"(?<![\w.])-?\d+(\.\d+)?(?![\w.])", data)] or [(0, 0)]
    first, last = rng.choice(spans)
    word = rng.choice(("1.0e+300", "-1.0e+300", "1.0e+15", "-1.0e+9", "1.0e-300", "4294967296", "1.0e+5", "-0.0"))
    return data[:first] + word.encode() + data[last:]


def _value(rng: random.Random, data: bytes) -> bytes:
    spans = [m.span(1) for m in re.finditer(rb"(?:[:=] ?)(\"[^\"\n]*\"|\[[^\]\n]*\]|[^\s,}\]>]+)", data)] or [(0, 0)]
    first, last = rng.choice(spans)
    word = rng.choice(HOSTILE).encode("utf-8", "surrogatepass")
    return data[:first] + (b'"' + word + b'"' if data[first : first + 1] == b'"' else word) + data[last:]


def _lines(change: Callable[[random.Random, list[bytes], int], None]) -> Callable[[random.Random, bytes], bytes]:
    def mutate(rng: random.Random, data: bytes) -> bytes:
        lines = data.splitlines(keepends=True) or [b""]
        change(rng, lines, rng.randrange(len(lines)))
        return b"".join(lines)

    return mutate


def _leave_out(_rng: random.Random, lines: list[bytes], at: int) -> None:
    del lines[at]


def _move(rng: random.Random, lines: list[bytes], at: int) -> None:
    lines.insert(rng.randrange(len(lines)), lines.pop(at))


def _indent(rng: random.Random, lines: list[bytes], at: int) -> None:
    lines[at] = rng.choice((b" ", b"\t", b"    ")) + lines[at] if rng.random() < 0.5 else lines[at].lstrip()


def _bytes(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.randint(1, 4)) + data[at + rng.randint(0, 4) :]


def _truncate(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _splice(rng: random.Random, data: bytes) -> bytes:
    first, last = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    at = rng.randrange(len(data) + 1)
    return data[:at] + data[first:last] + data[at:]


def _encode(rng: random.Random, data: bytes) -> bytes:
    return data.decode("utf-8", "replace").encode(
        rng.choice(("utf-16", "utf-8-sig", "utf-7", "cp1252", "utf-32")), "replace"
    )


MUTATIONS: dict[str, Callable[[random.Random, bytes], bytes]] = {
    "token": _token,
    "value": _value,
    "huge number": _huge,
    "line left out": _lines(_leave_out),
    "line twice": _lines(lambda _rng, lines, at: lines.insert(at, lines[at])),
    "line moved": _lines(_move),
    "indent": _lines(_indent),
    "bytes": _bytes,
    "cut": _truncate,
    "spliced": _splice,
    "encoding": _encode,
}
