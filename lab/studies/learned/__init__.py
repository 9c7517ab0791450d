"""Policies of all training seeds beside their controllers."""
