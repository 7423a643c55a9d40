"""Plant and estimator of monorig as two FMUs, connected by name in FMPy: `python co_simulation.py`, which needs `pip install fmpy`.

The script makes both FMUs for the scenario `minimal`, drives the train with a speed controller of three lines, and shows slope and mass.
"""

import math
import shutil
import subprocess
import sys

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

END_S, SPEED_MPS = 40.0, 1.0


class Fmu:
    """An FMU for co-simulation, FMI 2.0, by the names of its variables."""

    def __init__(self, file: str) -> None:
        about = read_model_description(file)
        self.variables = {v.name: v for v in about.modelVariables}
        self.default = about.defaultExperiment
        self.folder = extract(file)
        identifier = about.coSimulation.modelIdentifier
        self.fmu = FMU2Slave(guid=about.guid, unzipDirectory=self.folder, modelIdentifier=identifier, instanceName=identifier)
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()

    def names(self, causality: str) -> set[str]:
        return {name for name, v in self.variables.items() if v.causality == causality and v.type == "Real"}

    def get(self, names: list[str]) -> list[float]:
        return self.fmu.getReal([self.variables[name].valueReference for name in names])

    def set(self, names: list[str], values: list[float]) -> None:
        self.fmu.setReal([self.variables[name].valueReference for name in names], values)

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)


def make() -> None:
    for words in ("plant minimal --out plant.fmu", "estimator rail_fusion --scenario minimal --out rail_fusion.fmu"):
        subprocess.run(["monorig", "fmu", *words.split()], check=True)


def simulate() -> dict[str, float]:
    """The last estimates beside the truth."""
    plant, estimator = Fmu("plant.fmu"), Fmu("rail_fusion.fmu")
    step_s = float(plant.default.stepSize)  # the plant makes whole steps only
    stamped = estimator.variables["stamped"].valueReference
    estimator.fmu.setBoolean([stamped], [True])  # a sample is new where its instant has changed
    for one in (plant, estimator):
        one.fmu.exitInitializationMode()
    samples = sorted(plant.names("output") & estimator.names("input"))
    commands = sorted(plant.names("input") & estimator.names("input"))
    torques = [name for name in commands if name.startswith("command_motor_torque")]
    # the clamps keep the pressure that they start with, which is that of the scenario
    shown, integral = {}, 0.0
    for step in range(round(END_S / step_s)):
        t_s = step * step_s
        (speed,) = plant.get(["truth.speed"])
        error = min(SPEED_MPS, 0.25 * t_s) - speed
        integral += error * step_s
        torque = max(-180.0, min(180.0, 600.0 * error + 120.0 * integral))
        plant.set(torques, [torque] * len(torques))
        estimator.set(commands, plant.get(commands))
        plant.fmu.doStep(t_s, step_s)
        estimator.set(samples, plant.get(samples))
        estimator.fmu.doStep(t_s, step_s)
    for name, truth in (("grade", "truth.grade_at_imu"), ("total_mass", "truth.total_mass")):
        shown[name], shown[f"{name}_sd"] = estimator.get([name, f"{name}_sd"])
        (shown[truth],) = plant.get([truth])
    for one in (plant, estimator):
        one.close()
    return shown


if __name__ == "__main__":
    make()
    last = simulate()
    for name, value in last.items():
        print(f"{name:<20} {math.degrees(value):10.3f} deg" if "grade" in name else f"{name:<20} {value:10.0f} kg")
    # the train is on its climb, and both are within three standard deviations
    for name, truth in (("grade", "truth.grade_at_imu"), ("total_mass", "truth.total_mass")):
        if abs(last[name] - last[truth]) > 3.0 * last[f"{name}_sd"]:
            sys.exit(f"{name} is beyond three standard deviations")
