"""Rigs that the package's model lacks."""
