"""Runs what was built, and the same in Python, so that bits can be compared."""
