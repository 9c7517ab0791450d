"""Hands: the forces on the end effector."""
