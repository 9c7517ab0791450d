"""Policies beside the controller that they correct."""
