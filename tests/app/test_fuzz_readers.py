"""The readers of scenarios, cells, trees and records stand hostile files; `make fuzz` goes on where this ends."""

from fuzz_readers import fuzz


def test_twenty_hostile_files_end_in_success_or_findings() -> None:
    tally, failures = fuzz(20, seed=0)
    assert not failures, "\n".join(failures)
    assert sum(tally.values()) == 20
    assert tally["findings"] > 10
