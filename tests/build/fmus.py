"""Functional mock-up units in FMPy."""

import shutil

import numpy as np

from birthsim_env.loop.signals import REFERENCE_NAMES
from tests.build.targets import imported

fmpy = imported("fmpy")

PERIOD = 1e-3
OPENINGS, FORCES = [f"opening_{name}" for name in ("P1", "N1", "P2", "N2")], ["force_x", "force_y"]
REFERENCE = [f"reference_{name}" for name in REFERENCE_NAMES]


class Unit:
    """An instance of an FMU, by FMPy, where a simulation begins: variables by their names."""

    def __init__(self, path, **parameters):
        about = fmpy.read_model_description(path)
        self._numbers = {variable.name: variable.valueReference for variable in about.modelVariables}
        self.inputs, self.outputs, self.parameters = (
            [variable.name for variable in about.modelVariables if variable.causality == kind]
            for kind in ("input", "output", "parameter")
        )
        self.folder, self.ticks = fmpy.extract(path), 0
        self.two = about.fmiVersion == "2.0"
        self.unit = fmpy.instantiate_fmu(self.folder, about, "CoSimulation")
        if self.two:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.set(list(parameters), list(parameters.values()))
        self.unit.exitInitializationMode()

    def get(self, names):
        return np.array((self.unit.getReal if self.two else self.unit.getFloat64)([self._numbers[name] for name in names]))

    def set(self, names, values):
        if names:
            set_all = self.unit.setReal if self.two else self.unit.setFloat64
            set_all([self._numbers[name] for name in names], [float(value) for value in values])

    def step(self, periods=1):
        self.unit.doStep(currentCommunicationPoint=self.ticks * PERIOD, communicationStepSize=periods * PERIOD)
        self.ticks += periods

    def close(self):
        self.unit.terminate()
        self.unit.freeInstance()
        shutil.rmtree(self.folder)
