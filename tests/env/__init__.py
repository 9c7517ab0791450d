"""Tests of the environments and their loop."""
