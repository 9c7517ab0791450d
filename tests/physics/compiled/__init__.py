"""Compilation, and functions with the same bits everywhere."""
