"""Learning by gradients through the closed loop."""
