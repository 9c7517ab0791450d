"""The closed loop: stages over blocks of lanes, and what runs them."""
