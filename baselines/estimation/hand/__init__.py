"""Estimates of the force of the hand, without a force sensor."""
