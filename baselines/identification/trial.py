"""What a log holds of an experiment, as arrays."""

from dataclasses import dataclass

from birthsim_env.physics.compiled.lanes import Array


@dataclass(frozen=True)
class Trial:
    """T rows, one a period, SI units: ``times`` (T,); ``openings`` (4, T), each held until the next row; absolute
    ``pressures`` (4, T) of chambers P1, N1, P2, N2; ``positions`` (2, T) of the end effector as the log shows them, repeated
    until the tracker's next sample arrives; ``forces`` (2, T) of the hand."""

    times: Array
    openings: Array
    pressures: Array
    positions: Array
    forces: Array

    @property
    def period(self) -> float:
        """s from row to row."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))
