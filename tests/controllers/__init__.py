"""Tests of laws and what they work out."""
