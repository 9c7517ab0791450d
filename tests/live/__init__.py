"""Tests of the rig in the browser."""
