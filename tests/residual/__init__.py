"""Tests of residual and policies."""
