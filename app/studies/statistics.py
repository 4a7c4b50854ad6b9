"""Statistics of counts."""


def wilson_interval(successes: int, trials: int, level: float = 0.95) -> tuple[float, float]:
    r"""The Wilson score interval of a share (Wilson 1927); (0, 1) without trials.

    .. math:: \frac{\hat p + z^2 / 2n \pm z \sqrt{\hat p (1 - \hat p) / n + z^2 / 4n^2}}{1 + z^2 / n}

    with the share :math:`\hat p` of successes in n trials and the normal distribution's quantile z.
    """
    from scipy.stats import binomtest  # late: it takes 0.4 s

    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(level, method="wilson")
    return float(interval.low), float(interval.high)
