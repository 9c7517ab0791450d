"""The parts of an experiment: references, hands, stiffness setpoints, sensors, actuation, what is drawn at random."""
