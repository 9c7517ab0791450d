"""Controllers on a real rig: drivers, limits, a control loop in a process of its own, and its log."""
