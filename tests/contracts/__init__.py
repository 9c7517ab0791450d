"""What holds for everything that is registered: each new controller, sensor, scenario, hand and policy is tested at once."""
