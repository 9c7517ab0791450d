"""What is measured of the rig."""
