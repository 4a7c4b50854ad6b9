"""Declared keys: what the leaves of a task hand on beside their ports, on py_trees' blackboard.

    HELD: Key[float] = Key("toy/held", "width of what the hand holds, m")

    class Grip(Leaf):
        WRITES = (HELD,)     # and in work: self.write(HELD, 0.04)

    class Carry(Leaf):
        NEEDS = (HELD,)      # and in work: width = self.read(HELD)

    class LetGo(Leaf):
        READS = (HELD,)      # and in work: if self.read(HELD, None) is None: ...
        CLEARS = (HELD,)     # and in work: self.clear(HELD)

The check of a tree file finds a leaf whose key nothing can have written before its first tick. Nobody changes a value
that is written: who wants another writes a new one. By convention a key's name begins with its task's. Its place on the
blackboard is none that a port of a tree file can be wired to.
"""

import re
from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast, overload

from py_trees.blackboard import Blackboard, Client
from py_trees.common import Access

from regrasp.interfaces.cause import Cause

T = TypeVar("T")
U = TypeVar("U")
_NAME = re.compile(r"\w+(/\w+)*")


class _Nothing(Enum):
    NOTHING = "nothing"  # where None may be a value


NOTHING = _Nothing.NOTHING
Use = Literal["NEEDS", "READS", "WRITES", "CLEARS"]  # the attribute in which a class declares a key
USES: tuple[Use, ...] = ("NEEDS", "READS", "WRITES", "CLEARS")


@dataclass(frozen=True, eq=False)
class Key(Generic[T]):
    """A key of type T: `about` says in a phrase what it holds, with frame and unit.

    A reader of a key with a `default` gets it where nothing is written.

    Raises:
        ValueError: a name that is not words with slashes between them.
        TypeError: a default that can be changed, such as a list.
    """

    name: str  # such as button/place
    about: str
    default: T | _Nothing = NOTHING

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(
                f"a key's name is words with slashes between them, such as button/place, not {self.name!r}"
            )
        if not isinstance(self.default, Hashable):
            raise TypeError(f"the default of {self.name} can be changed, and all readers would share it; take a tuple")

    @property
    def path(self) -> str:
        """Where it lies on the blackboard: no port's path has a colon."""
        return f"/key:{self.name}"

    @property
    def text(self) -> str:
        """How messages name the key: button/place (its middle, m, in the world)."""
        return f"{self.name} ({self.about})"


Keys = tuple[Key[Any], ...]  # as a class declares them


class MissingKeyError(LookupError):
    """A key holds nothing and has no default."""

    def __init__(self, key: Key[Any]) -> None:
        super().__init__(f"{key.text} holds nothing: no leaf has written it, or one has cleared it")


CAUSES: Key[tuple[Cause, ...]] = Key("causes", "causes of the leaves that failed, the latest last", default=())


def declared(node: type, use: Use) -> Keys:
    """The keys that a class and its base classes declare in their attribute of that name."""
    return tuple(dict.fromkeys(key for cls in reversed(node.__mro__) for key in vars(cls).get(use, ())))


@overload
def value_of(key: Key[T]) -> T: ...
@overload
def value_of(key: Key[T], otherwise: U) -> T | U: ...
def value_of(key: Key[Any], otherwise: Any = NOTHING) -> Any:
    """What a key holds now, for the run's record; where it holds nothing, `otherwise`, or the key's default.

    Raises:
        MissingKeyError: it holds nothing, and there is neither.
    """
    return _or_default(key, Blackboard.storage.get(key.path, NOTHING), otherwise)


def put(key: Key[T], value: T) -> None:
    """Let a key hold a value before a tree or a leaf is run, as in a study."""
    Blackboard.storage[key.path] = value


def causes() -> tuple[Cause, ...]:
    """The causes of the leaves that have failed so far in this run, the latest last."""
    return value_of(CAUSES)


class WithKeys:
    """A node that may use the keys that its class declares; those of its base classes are declared with them.

    `NEEDS`: written before the node's first tick, else the check of the tree has a finding. `READS`: may hold nothing.
    `WRITES`: written, and cleared where it likes. `CLEARS`: cleared only, so that nobody takes it for a writer. A node
    that uses another key raises TypeError.
    """

    NEEDS: ClassVar[Keys] = ()
    READS: ClassVar[Keys] = ()
    WRITES: ClassVar[Keys] = ()
    CLEARS: ClassVar[Keys] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for key in declared(cls, "NEEDS"):
            if key.default is not NOTHING:
                raise TypeError(f"{cls.__name__} NEEDS {key.name}, whose default is always there; name it in READS")

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._keys: Client = cast(Any, self).attach_blackboard_client(name=f"{cast(Any, self).name} keys")
        for use in USES:
            for key in declared(type(self), use):
                self._keys.register_key(key.path, Access.READ if use in ("NEEDS", "READS") else Access.WRITE)

    @overload
    def read(self, key: Key[T]) -> T: ...
    @overload
    def read(self, key: Key[T], otherwise: U) -> T | U: ...
    def read(self, key: Key[Any], otherwise: Any = NOTHING) -> Any:
        """What the key holds; where it holds nothing, `otherwise`, or the key's default.

        Raises:
            MissingKeyError: it holds nothing, and there is neither. Let it pass out of `work` or `steps`: the leaf then
                fails, and says why.
        """
        self._check(key, Access.READ, "reads", "NEEDS or READS")
        try:
            held = self._keys.get(key.path)
        except KeyError:
            held = NOTHING
        return _or_default(key, held, otherwise)

    def write(self, key: Key[T], value: T) -> None:
        """Let the key hold a value, which nobody changes from now on."""
        self._check(key, Access.WRITE, "writes", "WRITES")
        if key not in declared(type(self), "WRITES"):
            raise TypeError(f"{type(self).__name__} writes {key.name}, which it only CLEARS; name it in WRITES")
        self._keys.set(key.path, value)

    def clear(self, key: Key[Any]) -> None:
        """Let the key hold nothing, as if nothing had ever written it."""
        self._check(key, Access.WRITE, "clears", "CLEARS or WRITES")
        self._keys.unset(key.path)

    def _check(self, key: Key[Any], access: Access, does: str, where: str) -> None:
        if not self._keys.is_registered(key.path, access):
            raise TypeError(f"{type(self).__name__} {does} {key.name}, which it does not declare; name it in {where}")


def _or_default(key: Key[Any], held: Any, otherwise: Any) -> Any:
    for value in (held, otherwise, key.default):
        if value is not NOTHING:
            return value
    raise MissingKeyError(key)
