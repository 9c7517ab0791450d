"""A long run through all scenarios, laws and corners of the ranges."""
