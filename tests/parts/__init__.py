"""Tests of the parts of an experiment."""
