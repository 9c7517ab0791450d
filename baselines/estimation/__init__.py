"""What controllers work out from sensors: pistons, disturbances, chambers, friction ahead."""
