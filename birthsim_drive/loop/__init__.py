"""The control loop: its process, what it keeps, and its timing."""
