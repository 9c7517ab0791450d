"""What a rig must not do, what happens where it does, and who looks."""
