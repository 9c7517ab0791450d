"""Drivers: each file registers one by its name."""
