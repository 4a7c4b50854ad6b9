"""Hierarchical task networks: the model of their files. A network says how a task is broken down into actions.

A state gives each variable one of its values. Conditions are partial states: each variable that they name must have the
value, or one of the values, that they give.
"""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from regrasp.interfaces.fields import Model

Word = Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,59}$")]
State = Mapping[str, str]


class Variable(Model):
    """What may be known of one thing."""

    values: Annotated[list[Word], Field(min_length=2, max_length=50, description="All that it may be.")]
    starts: Annotated[Word, Field(description="What it is taken to be when nothing was seen yet.")]


Condition = dict[Word, Word | Annotated[list[Word], Field(min_length=1)]]
Change = dict[Word, Word]


class Action(Model):
    """A primitive action: a child of the tree's TaskNetwork does it."""

    needs: Annotated[Condition, Field(default_factory=dict, description="What must be the case before it.")]
    gives: Annotated[Change, Field(default_factory=dict, description="What is the case after it.")]
    failed: Annotated[
        dict[Word, Change],
        Field(default_factory=dict, description="By cause: what is the case after it has failed for that."),
    ]
    tries: Annotated[
        int | None,
        Field(default=None, ge=1, description="The task fails when this has failed so often, for one cause."),
    ]


class Method(Model):
    """One way to do a task. The first method whose condition holds, and whose actions can be done, is taken."""

    name: Word
    when: Annotated[Condition, Field(default_factory=dict, description="Where it can be taken.")]
    do: Annotated[list[Word], Field(max_length=100, description="Tasks and actions, in their order.")]


class Impossible(Model):
    """A contradiction: what can never be the case at once."""

    state: Annotated[Condition, Field(min_length=2)]
    because: str


class TaskNetwork(Model):
    """A network of tasks."""

    description: str
    goal: Annotated[Word, Field(description="The task that is planned unless another is named.")]
    state: Annotated[dict[Word, Variable], Field(min_length=1)]
    impossible: Annotated[list[Impossible], Field(default_factory=list, description="What can never be.")]
    actions: Annotated[dict[Word, Action], Field(min_length=1)]
    tasks: Annotated[
        dict[Word, Annotated[list[Method], Field(min_length=1)]], Field(min_length=1, description="Methods by task.")
    ]

    def start(self) -> dict[str, str]:
        """The state when nothing was seen yet."""
        return {name: variable.starts for name, variable in self.state.items()}

    def unmet(self, action: str, state: State) -> str | None:
        """The first variable that an action needs otherwise than it is in a state; None: it can be done."""
        return unmet(self.actions[action].needs, state)

    def contradiction(self, state: State) -> str | None:
        """Why a state cannot be; None: it can."""
        return next((one.because for one in self.impossible if holds(one.state, state)), None)


def holds(condition: Condition, state: State) -> bool:
    """Whether a state fulfils a condition."""
    return unmet(condition, state) is None


def unmet(condition: Condition, state: State) -> str | None:
    """The first variable of a condition that a state does not fulfil; None: it fulfils all."""
    for name, wanted in condition.items():
        if state[name] not in ([wanted] if isinstance(wanted, str) else wanted):
            return name
    return None
