"""Air of chambers, tubes and valves."""
