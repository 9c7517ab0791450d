"""Closed loops over many lanes on a device with memory of its own: one thread a lane."""
