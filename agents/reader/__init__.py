"""Networks that read what a rig is from how it moves under a law (``baselines.estimation.rig_reader``): how they are taught."""
