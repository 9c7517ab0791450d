"""Dry friction of pistons."""
