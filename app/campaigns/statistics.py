"""Statistics of counts, and of runs in pairs."""

import math
from collections.abc import Sequence
from statistics import NormalDist


def wilson_interval(successes: int, trials: int, level: float = 0.95) -> tuple[float, float]:
    r"""The Wilson score interval of a share (Wilson 1927); (0, 1) without trials.

    .. math:: \frac{\hat p + z^2 / 2n \pm z \sqrt{\hat p (1 - \hat p) / n + z^2 / 4n^2}}{1 + z^2 / n}

    with the share :math:`\hat p` of successes in n trials and the normal distribution's quantile z.
    """
    if trials == 0:
        return 0.0, 1.0
    # Not by scipy.stats, which takes 0.4 s to import: every run's summary has an interval.
    share, z = successes / trials, NormalDist().inv_cdf(0.5 + level / 2)
    half = z * math.sqrt(share * (1 - share) / trials + (z / (2 * trials)) ** 2)
    middle, scale = share + z * z / (2 * trials), 1 + z * z / trials
    low, high = (middle - half) / scale, (middle + half) / scale
    return max(0.0, min(low, share)), min(1.0, max(high, share))  # rounded, an end may pass the share


def mcnemar_p(better: int, worse: int) -> float:
    """The two-sided p of the exact McNemar test (McNemar 1947): of the pairs that differ, half would be better.

    1 when no pair differs.
    """
    from scipy.stats import binomtest  # late: it takes 0.4 s

    return float(binomtest(better, better + worse).pvalue) if better + worse else 1.0


def detectable_share(pairs: int, level: float = 0.05, power: float = 0.8) -> float:
    """The smallest share of pairs that, if it got better and none worse, the exact McNemar test would likely show.

    It has p below `level` with the probability `power`; 1 when so few pairs cannot show anything.
    """
    least = math.ceil(1 - math.log2(level))  # 2 / 2^k < level
    if pairs < least:
        return 1.0
    low, high = 0.0, 1.0  # shares that are seen too seldom, and often enough; not by scipy, which takes a second
    while high - low > 1e-9:
        share = (low + high) / 2
        seldom = sum(math.comb(pairs, k) * share**k * (1 - share) ** (pairs - k) for k in range(least)) > 1 - power
        low, high = (share, high) if seldom else (low, share)
    return high


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float, float]:
    """The median, and an interval that holds the population's by its order statistics (Conover 1999, section 3.2).

    The interval is the whole range when there are too few values; nan without values.
    """
    from scipy.stats import binom

    ordered = sorted(values)
    n = len(ordered)
    if n == 0:
        return math.nan, math.nan, math.nan
    middle = 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2])
    rank = int(binom.ppf((1 - level) / 2, n, 0.5))  # so many may lie below the interval
    return middle, ordered[max(0, rank - 1)], ordered[min(n - 1, n - rank)]
