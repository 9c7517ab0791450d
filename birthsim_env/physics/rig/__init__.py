"""What describes a rig: parameters, their units, bounds and files."""
