"""Where the pistons hold the end effector, and what moves with it."""
