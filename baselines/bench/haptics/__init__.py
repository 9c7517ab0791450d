"""What a hand feels at the end effector, measured: impedance, own error, energy, stability, friction, release (docs/haptics.md)."""
