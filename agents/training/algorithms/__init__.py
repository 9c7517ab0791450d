"""Algorithms by which policies learn, one a file, which registers it with its hyperparameters."""
