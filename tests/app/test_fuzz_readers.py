"""The readers of scenarios, cells, trees and records stand hostile files; `make fuzz` goes on where this ends."""

from fuzz_readers import fuzz


def test_sixty_hostile_files_end_in_success_or_findings() -> None:
    tally, failures = fuzz(60, seed=0)
    assert not failures, "\n".join(failures)
    assert tally["clean"] > 0  # some mutations do no harm, or nothing was read
    assert tally["findings"] > 100
