"""Policies: their network, files, controller and export."""
