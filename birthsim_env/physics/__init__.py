"""The rig and nothing else: its description, geometry, mechanics, friction, chambers, valves, and their integration."""
