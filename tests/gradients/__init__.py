"""Gradients against differences, forward against reverse mode, and primal bits."""
