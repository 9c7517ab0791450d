"""A log in windows: what was measured in each, and what a rig would have shown."""
