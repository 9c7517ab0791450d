"""What there is to choose from, by name."""

from birthsim_env.registry import names


def controllers() -> list[str]:
    """List the registered controllers.

    Returns
    -------
    list of str
        Names that ``make_controller``, ``evaluate`` and the commands take. A name may carry options,
        ``"pid[bandwidth=60]"``; a controller of your own is named by its file, ``"path/to/file.py:Class"``.

    See Also
    --------
    register : adds a controller to the list.

    Examples
    --------
    >>> import birthsim
    >>> {"backstepping", "admittance", "pid"} <= set(birthsim.controllers())
    True
    """
    return names("controller")


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
    return names("policy")
