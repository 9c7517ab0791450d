"""What gradients through the closed loop cost, and how far they can be trusted."""
