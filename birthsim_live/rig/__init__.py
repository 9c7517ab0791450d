"""The rig that a person plays with: motion, hand, setpoints, recordings, and real time."""
