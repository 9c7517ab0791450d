"""Trained policies that come with the package."""

from agents.policy.seeds import shipped_names


def policies() -> list[str]:
    """List the trained policies that come with the package.

    Returns
    -------
    list of str
        Names that ``load_policy`` takes, and ``"residual:NAME"`` as a controller's name.

    Examples
    --------
    >>> import birthsim
    >>> "circle" in birthsim.policies()
    True
    """
    return shipped_names()
