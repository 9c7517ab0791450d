"""A small biomechanical model of the second stage of labour."""
