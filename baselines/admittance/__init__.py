"""Backstepping behind a Cartesian mass, spring and damper."""
