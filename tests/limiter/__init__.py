"""Tests of the limits at the port."""
