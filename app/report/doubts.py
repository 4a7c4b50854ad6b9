"""What so many runs cannot tell, in sentences."""

import math
from collections.abc import Iterator, Sequence

from regrasp.app.campaigns.figures import CaseFigures
from regrasp.app.campaigns.statistics import detectable_share, wilson_interval
from regrasp.app.report.knobs import Knob

FEW = 10  # runs of a value; with fewer the interval is wider than half of all that is possible


def doubts(together: CaseFigures, cases: Sequence[CaseFigures], knobs: Sequence[Knob]) -> Iterator[str]:
    """The sentences of a campaign."""
    n, k = together.runs, together.succeeded
    low, high = together.interval
    more = 4 * n if 0 < k < n else 2 * n + 4  # Wilson's interval is z^2 / (n + z^2) wide where all came out alike
    yield (
        f"The share of success: {k} of {n} fits anything from {_percent(low)} to {_percent(high)} (95 %). "
        f"For an interval half as wide about {more} runs are needed."
    )
    if k == n:
        yield f"No run failed; and yet {n} such runs fit a robot that fails one time in {math.floor(1 / (1 - low))}."
    share = detectable_share(n)
    told = f"{_percent(share)} of the scenes got better and none worse" if share < 1 else "anything"
    yield (
        f"A change of the robot: these {n} scenes, run again after it, would show with 80 % probability that {told}; "
        "less is likely to be missed."
        if share < 1
        else f"A change of the robot: {n} scenes are too few to show that it got better."
    )
    small = [case for case in cases if case.runs < FEW]
    if small:
        width = wilson_interval(small[0].succeeded, small[0].runs)
        yield (
            f"Single cases: {len(small)} of {len(cases)} have fewer than {FEW} runs; {small[0].case} with "
            f"{small[0].succeeded} of {small[0].runs} fits {_percent(width[0])} to {_percent(width[1])}."
        )
    if knobs and not any(knob.apart for knob in knobs):
        yield "What decides: no knob of the scene has two values whose intervals lie apart; differences may be chance."
    elif len(knobs) > 1:
        yield (
            f"What decides: of {len(knobs)} knobs looked at, one in twenty looks decisive by chance; and knobs that "
            "vary together cannot be told apart."
        )
    yield (
        "Scenes: of what a seed draws, only numbers are looked at here, not places or colours; campaigns from before "
        "that was kept have none."
    )
    yield "Reality: all of it is simulation, with its own limits; an interval speaks of these scenes and no others."


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
