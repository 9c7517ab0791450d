"""Tests of what laws work out from sensors."""
