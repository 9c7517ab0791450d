"""What is measured of the rig: a sensor model a file, registered there, and what these are made of."""
