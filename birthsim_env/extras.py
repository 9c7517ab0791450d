"""How an extra is installed: the words that end every message about a missing one."""


def installation(*extras: str) -> str:
    """The command that installs ``extras``, and where: BirthSIM is on no index, so it is installed from a clone.

    Examples
    --------
    >>> installation("agents", "onnx")
    "pip install -e '.[agents,onnx]' in a clone"
    """
    return f"pip install -e '.[{','.join(extras)}]' in a clone"
