"""What every environment pays to whom."""
