"""Base classes of all leaves, and their ports."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from py_trees.common import Status
from py_trees.ports import BehaviourWithPorts, PortInformation

from regrasp.behaviors.keys import CAUSES, Keys, MissingKeyError, WithKeys
from regrasp.behaviors.services import Services
from regrasp.interfaces.cause import Cause, CauseCode, ServiceError
from regrasp.interfaces.request import Request, RequestError

T = TypeVar("T")
LeafSteps = Generator[Request[Any] | None, None, None]


class LeafFailed(Exception):  # noqa: N818 - it names the leaf's outcome
    """Raised inside `steps`: the leaf ends in FAILURE with this cause."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class LeafPort(PortInformation):
    """A port with limits that the check of a tree file enforces.

    A number is more than `above`, and `least` or more; a string is one of the `names` that the cell gives to this kind
    of thing.
    """

    above: float | None = None
    least: float | None = None
    names: str | None = None


class WithServices(WithKeys):
    """A node of a tree that has the run's services, uses declared keys, and says why it fails.

    Override `work`; py_trees calls it through `update`. When a service raises ServiceError the arms stop and the node
    fails; it fails also when a key that it reads holds nothing. Any other exception is a programming error and ends the
    run.
    """

    READS: ClassVar[Keys] = (CAUSES,)
    WRITES: ClassVar[Keys] = (CAUSES,)

    name: str
    feedback_message: str
    services: Services

    def setup(self, **kwargs: Any) -> None:
        """Keep the services that `BehaviourTree.setup(services=...)` passes to every node."""
        self.services = kwargs["services"]

    @property
    def path(self) -> str:
        """Where the node stands in its tree, such as root/carry/move."""
        return str(self.name.replace(".", "/"))

    def fail(self, code: str, message: str) -> Status:
        """Record the cause and return FAILURE."""
        return self.fail_with(Cause(code, message, self.path))

    def fail_with(self, cause: Cause) -> Status:
        """Record a cause, which may be another node's, and return FAILURE."""
        self.write(CAUSES, (*self.read(CAUSES), cause))
        self.feedback_message = cause.message
        values = {} if cause.node == self.path else {"of": cause.node}
        self.services.log.warning("failed", node=self.path, code=str(cause.code), message=cause.message, **values)
        return Status.FAILURE

    def work(self) -> Status:
        """Do one tick of the work."""
        raise NotImplementedError

    def update(self) -> Status:
        """Tick, and fail when a service breaks off or a key holds nothing."""
        try:
            return self.work()
        except ServiceError as error:
            self.services.motion.stop()
            return self.fail(CauseCode.SERVICE_FAILED, str(error))
        except MissingKeyError as error:
            return self.fail(CauseCode.KEY_MISSING, str(error))

    def say(self, event: str, **values: Any) -> None:
        """Write an event of this node into the run's log."""
        self.services.log.info(event, node=self.path, **values)


class Leaf(WithServices, BehaviourWithPorts):
    """A leaf with services, which says why it fails."""

    # The statuses that `update` may return. The tree's check needs them to find nodes that are never reached.
    RETURNS: ClassVar[frozenset[Status]] = frozenset({Status.SUCCESS, Status.FAILURE, Status.RUNNING})


class StepsLeaf(Leaf):
    """A leaf whose work is a sequence: `steps()` yields a `Request` to be done, or None to wait for a tick.

    It ends in SUCCESS when the steps end, and in FAILURE when they raise `LeafFailed` or a request raises
    RequestError.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    _request: Request[Any] | None = None

    def steps(self) -> LeafSteps:
        """The work, as a generator that goes on when the request that it yielded is done."""
        raise NotImplementedError

    def initialise(self) -> None:
        """Begin anew."""
        self._work, self._request = self.steps(), None

    def work(self) -> Status:
        """Poll the request under way; when it is done take the next step."""
        try:
            while self._request is None or self._request.poll():
                self._request = next(self._work)
                if self._request is None:
                    return Status.RUNNING
        except StopIteration:
            return Status.SUCCESS
        except (RequestError, LeafFailed) as error:
            return self.fail(error.code, str(error))
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Stop the arm if this leaf was RUNNING; one that had ended has nothing to stop."""
        if self.status is Status.RUNNING and new_status is Status.INVALID:
            if self._request is not None:
                self._request.cancel()
            self._work.close()

    def ask(self, request: Request[T]) -> Generator[Request[Any] | None, None, T]:
        """Steps that do a request and return its answer, for a leaf that needs it, or that handles its RequestError.

        The request stops with the leaf.
        """
        try:
            while not request.poll():
                yield None
        except GeneratorExit:
            request.cancel()
            raise
        return request.answer

    def wait(self, seconds: float) -> LeafSteps:
        """Steps that let so many simulated seconds pass."""
        end = self.services.clock.now() + seconds
        while self.services.clock.now() < end - 1e-9:
            yield None
