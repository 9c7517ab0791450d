"""What a hand feels of a rig without a force sensor."""
