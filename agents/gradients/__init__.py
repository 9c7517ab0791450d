"""Closed loops that a library differentiates: PyTorch and JAX."""
