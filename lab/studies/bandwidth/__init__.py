"""Up to which frequency a hand feels the impedance declared."""
