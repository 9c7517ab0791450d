"""A closed loop differentiated: each stage's adjoint, generated from the stage that runs, and a tape of what they read."""
