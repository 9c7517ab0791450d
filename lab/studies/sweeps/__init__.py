"""Sweeps: many evaluations and trainings from one file."""
