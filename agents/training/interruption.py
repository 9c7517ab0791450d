"""How a training ends that is asked to: after the update that it is in, with a checkpoint."""

WORDS = "it ends after this update, with a checkpoint; once more: at once"
"""Said when a signal asks a training to end."""


class Interrupted(Exception):  # noqa: N818  nothing has gone wrong
    """A training has ended before it had learned all, since that was asked for; says what is kept."""
