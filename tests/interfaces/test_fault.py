import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from regrasp.interfaces.cable.fault import FAULTS as CABLE_FAULTS
from regrasp.interfaces.cable.fault import CableWhen
from regrasp.interfaces.fault import FAULTS, Fault

Span = tuple[float, float]
spans = st.tuples(st.floats(0, 1), st.floats(0, 1)).map(lambda pair: (min(pair), max(pair)))


@given(spans, st.sampled_from(["at", "carried"]), st.integers(0, 1000))
def test_a_drawn_moment_lies_within_its_range_and_a_seed_repeats_it(span: Span, name: str, seed: int) -> None:
    when = CableWhen.model_validate({name: span})
    one, two = (when.drawn(np.random.default_rng(seed)) for _ in range(2))
    assert one == two
    least, most = getattr(one, name)
    assert span[0] <= least == most <= span[1]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({}, "nothing given; give one of at, carried, node, phase"),
        ({"at": (1, 2), "node": "carry"}, "at and node given"),
        ({"phase": "lost", "after": (1, 2)}, "after goes with node"),
        ({"node": "carry", "after": (2, 1)}, "runs backwards; put the smaller first"),
    ],
)
def test_a_moment_is_said_in_one_way(data: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        CableWhen.model_validate(data)


@pytest.mark.parametrize("fault", [*FAULTS, *CABLE_FAULTS])
def test_every_field_says_what_it_is_with_an_example_that_holds(fault: type[Fault]) -> None:
    assert fault.__doc__
    assert all(field.description and field.examples for field in fault.model_fields.values())
    example = {name: field.examples[0] for name, field in fault.model_fields.items() if field.examples}
    assert fault.model_validate(example)
