"""Functional mock-up units: the rig for tools that speak FMI."""
