"""Controllers by their names."""

from baselines.registry import controller_names


def controllers() -> list[str]:
    """List the registered controllers.

    Returns
    -------
    list of str
        Names that ``make_controller``, ``evaluate`` and the commands take. A name may carry options,
        ``"pid[bandwidth=60]"``; a controller of your own is named by its file, ``"path/to/file.py:Class"``.

    Examples
    --------
    >>> import birthsim
    >>> {"backstepping", "admittance", "pid"} <= set(birthsim.controllers())
    True
    """
    return controller_names()
