"""Frequency responses of the rig with shut valves."""
