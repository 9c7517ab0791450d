"""A rig beside a log: how far the model is off in each signal, when it leaves the log, and which of several rigs is nearest."""
