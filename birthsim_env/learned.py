"""The way from here to ``agents``, which stands above this package: by name, and only where that name is BirthSIM's.

Other distributions (``openai-agents``) and folders of users have packages of that name too.
"""

from importlib import import_module
from typing import Any


def from_agents(module: str) -> Any:
    """A ``module`` below ``agents``; raises ``ImportError`` in one line where another package of that name is in its place."""
    mend = "rename or uninstall it, then pip install --force-reinstall --no-deps -e . in a clone"
    try:
        package = import_module("agents")
    except Exception as error:
        raise ImportError(f"the package 'agents' cannot be imported ({type(error).__name__}: {error}); {mend}") from error
    if not getattr(package, "BELONGS_TO_BIRTHSIM", False):
        place = package.__file__ or ", ".join(package.__path__)
        raise ImportError(f"the package 'agents' at {place} is not BirthSIM's but hides or overwrites it; {mend}")
    return import_module(module)


def residual_env(**arguments: Any) -> Any:
    """Entry point of the ids with a law inside."""
    return from_agents("agents.residual.env").ResidualEnv(**arguments)


def residual_vector_env(**arguments: Any) -> Any:
    """Entry point of the vectorised ids with a law inside."""
    return from_agents("agents.residual.env").ResidualVectorEnv(**arguments)
