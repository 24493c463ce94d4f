"""Student's distribution, both ways; `scipy.stats` has it too, and is a quarter of a second to load."""

from scipy.special import stdtr, stdtrit


def beyond(value: float, freedom: float) -> float:
    """Probability of a value above this one.

    Parameters
    ----------
    value : float
    freedom : float
        Degrees of freedom.

    Examples
    --------
    >>> round(beyond(2.0, 10.0), 4)
    0.0367
    """
    return float(stdtr(freedom, -value))


def limit(share: float, freedom: float) -> float:
    """The value that this share lies above.

    Parameters
    ----------
    share : float
    freedom : float
        Degrees of freedom.

    Examples
    --------
    >>> round(limit(beyond(2.0, 10.0), 10.0), 6)
    2.0
    """
    return float(-stdtrit(freedom, share))
