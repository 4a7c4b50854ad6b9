import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.interfaces.quote import MAX_QUOTE, cut, quoted


@given(st.text() | st.binary(max_size=200) | st.lists(st.integers()))
def test_what_is_quoted_is_short_and_whole_where_it_can_be(value: object) -> None:
    whole, text = repr(value), quoted(value)
    assert len(text) <= MAX_QUOTE
    assert text == whole or (len(whole) > MAX_QUOTE and "..." in text)


@pytest.mark.parametrize("most", [60, 180])
def test_a_long_text_keeps_both_ends(most: int) -> None:
    assert cut("a" * 3000 + "b" * 3000, most) == "a" * (most - 23) + "..." + "b" * 20
