"""Studies: what the project measures of itself and of its controllers; not in the wheel."""
