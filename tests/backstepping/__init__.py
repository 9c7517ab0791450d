"""Tests of the paper's law."""
