"""Residual policies on top of the published control law."""
