"""What a hand feels: impedance, own error, energy, stability, friction, the release of a pull (docs/laboratory/haptics.md)."""
