"""A rig of a laboratory from its logs: experiment, prediction, estimate."""
