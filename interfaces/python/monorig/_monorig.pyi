"""The native half of the package."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy.typing as npt

# numbers in rows; None in a list is no number
Numbers = npt.ArrayLike | Sequence[Any]

__version__: str
PROCESSORS: int

class ArrowArray(Protocol):
    """A record batch of any library of Arrow."""

    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]: ...

class ArrowTable(Protocol):
    """A table of any library of Arrow."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

class Table:
    """A table has columns of equal length with units; ``pyarrow.record_batch(it)`` and ``polars.DataFrame(it)`` copy nothing.

    The unit of a column is in the metadata of its Arrow field, under ``unit``.
    """

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
    @property
    def units(self) -> dict[str, str]:
        """Units of the columns that have one."""
    @property
    def num_rows(self) -> int:
        """Number of rows."""
    def __len__(self) -> int: ...
    def __contains__(self, name: str) -> bool: ...
    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A column as an array, shape (rows,); NaN where a row has no value."""
    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]: ...
    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Writes the table to a Parquet file."""
    @staticmethod
    def from_parquet(path: str | os.PathLike[str]) -> Table:
        """Reads a table from a Parquet file."""

class Vehicle:
    """A vehicle has the nominal values of the train, for which estimators are built.

    Args:
        tare_kg: Mass of the empty train, kg.
        wheel_radius_m: Radius of the friction wheels, m.
        mass_range_kg: Smallest and largest possible total mass, kg.
        drives: Number of drive units.
        gear_ratio: Motor revolutions per wheel revolution.
        efficiency: Share of the motor power that reaches the rim, 0…1.
        rotating_mass_kg: Rotating masses reflected to the rim, kg.
        running_resistance: Running-resistance coefficient.
        tare_span_m: From where to where behind the middle of the unit with the IMU the tare is spread, m.
        load_span_m: The same for the load, m.
        imu_arm_m: Distance of the IMU ahead of this middle, m.
        accel_bias_sd_mps2: Standard deviation of the accelerometer's bias, m/s²; None is not known.
        gyro_bias_sd_radps: Standard deviation of the gyro's biases, rad/s; None is not known.
        mass_guess_kg: First guess of the total mass, kg, from which estimators start; None is not known.

    Raises:
        InputError: No such vehicle can be.
    """

    def __init__(
        self,
        *,
        tare_kg: float,
        wheel_radius_m: float,
        mass_range_kg: Sequence[float],
        drives: int = 1,
        gear_ratio: float = 1.0,
        efficiency: float = 1.0,
        rotating_mass_kg: float = 0.0,
        running_resistance: float = 0.0,
        tare_span_m: Sequence[float] = ...,
        load_span_m: Sequence[float] = ...,
        imu_arm_m: float = 0.0,
        accel_bias_sd_mps2: float | None = None,
        gyro_bias_sd_radps: float | None = None,
        mass_guess_kg: float | None = None,
    ) -> None: ...
    @staticmethod
    def from_scenario(path: str | os.PathLike[str]) -> Vehicle:
        """Returns the vehicle as a scenario gives it to its estimators."""
    def to_json(self) -> str:
        """Returns all values as a vehicle file of maps has them."""
    @staticmethod
    def from_json(text: str) -> Vehicle:
        """Returns the vehicle of a text that `to_json` has made."""
    @property
    def tare_kg(self) -> float: ...
    @property
    def drives(self) -> int: ...
    @property
    def wheel_radius_m(self) -> float: ...
    @property
    def gear_ratio(self) -> float: ...
    @property
    def efficiency(self) -> float: ...
    @property
    def rotating_mass_kg(self) -> float: ...
    @property
    def running_resistance(self) -> float: ...
    @property
    def mass_range_kg(self) -> tuple[float, float]: ...
    @property
    def mass_guess_kg(self) -> float | None: ...
    @property
    def accel_bias_sd_mps2(self) -> float | None: ...
    @property
    def gyro_bias_sd_radps(self) -> float | None: ...

class Command:
    """A command goes to the train.

    Args:
        motor_torque: Torque of each motor, N·m, + drives towards growing chainage.
        clamp_pressure: Clamp pressure, MPa; None leaves it as the events of the scenario ask.
        brake: Share of the brake force, 0…1; None leaves it, too.
    """

    def __init__(
        self,
        motor_torque: Sequence[float],
        *,
        clamp_pressure: float | None = None,
        brake: float | None = None,
    ) -> None: ...
    @property
    def motor_torque(self) -> list[float]: ...
    @property
    def clamp_pressure(self) -> float | None: ...
    @property
    def brake(self) -> float | None: ...

class Measurements:
    """Measurements are the new samples since the last step; None (or NaN in a list) where there is no new sample.

    Args:
        t_ns: Now, ns; all samples are stamped with it.
        specific_force: Acceleration minus gravity in IMU axes (forward, left, up), m/s².
        angular_rate: Angular rate in the same axes, rad/s.
        motor_torque: Torque of each motor, N·m.
        wheel_speed: Speed of the friction wheels of each drive unit, m/s.
        clamp_pressure: Clamp pressure of each drive unit, MPa.
        inclination: Pitch by the inclinometer, rad.
        steering_angle: Steering angle of a road vehicle, rad.
        auxiliary: Readings of instruments of your own.
        command: The command of the step.
    """

    def __init__(
        self,
        t_ns: int,
        *,
        specific_force: Sequence[float] | None = None,
        angular_rate: Sequence[float] | None = None,
        motor_torque: Sequence[float | None] | None = None,
        wheel_speed: Sequence[float | None] | None = None,
        clamp_pressure: Sequence[float | None] | None = None,
        inclination: float | None = None,
        steering_angle: float | None = None,
        auxiliary: Sequence[float | None] | None = None,
        command: Command | None = None,
    ) -> None: ...
    @property
    def t_ns(self) -> int: ...
    @property
    def t_s(self) -> float: ...
    @property
    def specific_force(self) -> tuple[float, float, float] | None: ...
    @property
    def angular_rate(self) -> tuple[float, float, float] | None: ...
    @property
    def motor_torque(self) -> list[float | None]: ...
    @property
    def wheel_speed(self) -> list[float | None]: ...
    @property
    def clamp_pressure(self) -> list[float | None]: ...
    @property
    def inclination(self) -> float | None: ...
    @property
    def steering_angle(self) -> float | None: ...
    @property
    def auxiliary(self) -> list[float | None]: ...
    @property
    def command(self) -> Command: ...
    def stamp_ns(self, name: str, index: int = 0) -> int | None:
        """Returns when the sample of a quantity was taken, ns: ``stamp_ns("wheel_speed", 1)``; None without a new one."""

class Estimate:
    """An estimate has the value of each quantity, its standard deviation and whether it is valid.

    Args:
        total_mass: Total mass, kg.
        grade: Grade at the IMU, rad, + uphill towards growing chainage.
        effective_grade: Grade that the train as a whole feels, rad; None is the grade at the IMU.
        speed: Speed along the rail, m/s.
        innovation: Innovation of the last measurement.
        nis: Its normalised square, 1 on average when consistent.
        flags: Status: moving, mass excited, a limit acts.
        t_ns: The instant, ns; a run puts the instant of the step.
        protection: Protection levels of total mass (kg), grade and effective grade (rad); 0 is none.
    """

    def __init__(
        self,
        *,
        total_mass: tuple[float, float, bool] = ...,
        grade: tuple[float, float, bool] = ...,
        effective_grade: tuple[float, float, bool] | None = None,
        speed: tuple[float, float, bool] = ...,
        innovation: float = 0.0,
        nis: float = 0.0,
        flags: tuple[bool, bool, bool] = ...,
        t_ns: int = 0,
        protection: tuple[float, float, float] = ...,
    ) -> None: ...
    @property
    def t_ns(self) -> int: ...
    @property
    def total_mass(self) -> tuple[float, float, bool]: ...
    @property
    def grade(self) -> tuple[float, float, bool]: ...
    @property
    def effective_grade(self) -> tuple[float, float, bool]: ...
    @property
    def speed(self) -> tuple[float, float, bool]: ...
    @property
    def innovation(self) -> float: ...
    @property
    def nis(self) -> float: ...
    @property
    def flags(self) -> tuple[bool, bool, bool]: ...
    @property
    def protection(self) -> tuple[float, float, float]: ...

class Estimator:
    """An estimator of ours, by its name; `names` lists them, `parameters` what they can be given.

    Raises:
        InputError: An unknown name, an unknown parameter, a value out of its range.
    """

    def __init__(self, name: str, vehicle: Vehicle, **params: float | bool | str) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def vehicle(self) -> Vehicle:
        """The vehicle that it was built for."""
    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters that it was given."""
    def step(self, z: Measurements, dt: float) -> Estimate:
        """Makes a step of ``dt`` seconds with the samples in ``z``.

        Raises:
            InputError: The step is refused; the estimator is as it was.
        """
    def run(
        self,
        t_ns: Numbers,
        *,
        dt_s: float | None = None,
        specific_force: Numbers | None = None,
        angular_rate: Numbers | None = None,
        motor_torque: Numbers | None = None,
        wheel_speed: Numbers | None = None,
        clamp_pressure: Numbers | None = None,
        inclination: Numbers | None = None,
        steering_angle: Numbers | None = None,
        auxiliary: Numbers | None = None,
    ) -> Table:
        """Makes all steps at once, a row each; other threads of Python run meanwhile.

        Lists and arrays of any numbers will do, NaN or None where there is no new sample; float64 in one piece is not
        copied.

        Args:
            t_ns: Instants of the steps, ns, shape (n,).
            dt_s: Length of the first step, s; None is the length of the second.
            specific_force: m/s², shape (n, 3).
            angular_rate: rad/s, shape (n, 3).
            motor_torque: N·m, shape (n, drives).
            wheel_speed: m/s, shape (n, drives).
            clamp_pressure: MPa, shape (n, drives).
            inclination: rad, shape (n,).
            steering_angle: rad, shape (n,).
            auxiliary: shape (n, k).

        Returns:
            ``t_ns``, and of each quantity ``total_mass`` (kg), ``grade``, ``effective_grade`` (rad), ``speed`` (m/s)
            the value, ``…_sd`` and ``…_valid``, of the first three ``…_protection``. A refused step is null, and a
            warning tells why.
        """
    def run_samples(self, table: ArrowTable | ArrowArray) -> Table:
        """Makes all steps over the columns of ``samples.parquet``: what a run gave to its estimators, bit for bit."""
    def reset(self) -> None:
        """Goes back to the state in which the estimator was built."""
    def snapshot(self) -> bytes:
        """Returns the state."""
    def restore(self, snapshot: bytes) -> None:
        """Takes over the state of a snapshot of the same estimator, vehicle and parameters."""
    def internal_values(self) -> dict[str, float]:
        """Returns the internal quantities now, by name."""

class Reference:
    """A reference is the task of the controller in a step."""

    @property
    def speed_mps(self) -> float: ...
    @property
    def accel_mps2(self) -> float: ...
    @property
    def emergency_brake(self) -> float: ...
    @property
    def clamp_pressure_mpa(self) -> float: ...

class Perception:
    """A perception is the knowledge of the controller in a step: speed by the wheels, mass and grade, slip of each unit."""

    @property
    def speed_mps(self) -> float: ...
    @property
    def grade_rad(self) -> float: ...
    @property
    def total_mass_kg(self) -> float: ...
    @property
    def valid(self) -> bool: ...
    @property
    def slip_mps(self) -> list[float]: ...
    @property
    def estimate(self) -> Estimate | None: ...

class ControllerSetup:
    """A controller's setup has the data for which it is built, beside the vehicle."""

    @property
    def motor_torque_max_nm(self) -> float: ...
    @property
    def gravity_mps2(self) -> float: ...
    @property
    def start_speed_mps(self) -> float: ...

class Frame:
    """A frame is the state after a step of a `Simulation`."""

    @property
    def time_s(self) -> float: ...
    @property
    def sampled(self) -> bool:
        """True if a sample arrived, so that the estimators made a step."""
    @property
    def measurements(self) -> Measurements: ...
    @property
    def estimates(self) -> dict[str, Estimate]:
        """The last estimate of each estimator."""
    @property
    def truth(self) -> dict[str, float]:
        """The truth: ``time_s``, ``chainage_m``, ``speed_mps``, ``grade_at_imu_rad``, ``grade_effective_rad``,
        ``total_mass_kg``."""
    @property
    def events(self) -> list[str]: ...

class NativeRun:
    @property
    def channels(self) -> Table: ...
    @property
    def samples(self) -> Table | None: ...
    @property
    def summary_json(self) -> str: ...
    @property
    def resolved_json(self) -> str: ...
    @property
    def good(self) -> bool: ...
    @property
    def verdict(self) -> str: ...
    @property
    def failures(self) -> list[str]: ...
    @property
    def finished(self) -> bool: ...
    @property
    def events(self) -> list[tuple[float, str]]: ...
    @property
    def refusals(self) -> list[tuple[str, int, str]]: ...
    def save(self, out: str, recording: bool) -> str: ...
    def record(self, path: str) -> bool: ...
    def report_html(self) -> str: ...

class NativeSimulation:
    def __init__(
        self,
        path: str,
        seed: int | None,
        set: dict[str, object] | None,
        estimators: dict[str, object] | None,
        controller: object | None,
        in_loop: str | None,
    ) -> None: ...
    @property
    def over(self) -> bool: ...
    @property
    def time_s(self) -> float: ...
    @property
    def dt_s(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def motor_torque_max_nm(self) -> float: ...
    @property
    def reference(self) -> Reference: ...
    @property
    def perception(self) -> Perception: ...
    def step(self, command: object | None = None) -> Frame: ...
    def result(self) -> NativeRun: ...

class NativeObjective:
    def __init__(self, file: str, cache: str, jobs: int, progress: Callable[[str, float], None] | None) -> None: ...
    @property
    def space_json(self) -> str: ...
    @property
    def defaults_json(self) -> str: ...
    def score(self, parameters: str) -> str: ...

class NativeSeries:
    @property
    def count(self) -> int: ...
    def run(self, index: int) -> str: ...
    def result(self, runs: list[str]) -> str: ...

def names() -> list[str]:
    """Returns the names of all our estimators, those as printed in their source, too."""

def parameters(name: str) -> list[dict[str, Any]]:
    """Returns the parameters of an estimator of ours: name, doc, default, and unit and range of a number or choices of a word."""

def run(
    path: str,
    seed: int | None,
    set: dict[str, object] | None,
    estimators: dict[str, object] | None,
    controller: object | None,
    in_loop: str | None,
    keep_samples: bool,
) -> NativeRun: ...
def replay(
    log: str | None, map: str, estimators: dict[str, object] | None, set: dict[str, object] | None
) -> NativeRun: ...
def run_one(
    path: str,
    seed: int,
    set: Mapping[str, object] | None,
    estimators: Mapping[str, object] | None,
    controller: object | None,
    in_loop: str | None,
    reference: str | None,
) -> str: ...
def outline(
    path: str,
    set: Mapping[str, object] | None,
    estimators: Mapping[str, object] | None,
    controller: object | None,
    in_loop: str | None,
) -> tuple[str, list[int], list[str]]: ...
def compare(
    runs: list[str], estimators: list[str], metrics: list[str], reference: str, path: str
) -> str: ...
def judge(scenario: str, runs: list[str]) -> str: ...
def metrics() -> list[tuple[str, str]]: ...
def kind(path: str) -> str | None: ...
def colour_place(name: str) -> int: ...
def load(folder: str) -> NativeRun: ...
def stress(
    paths: list[str],
    folders: list[str],
    only: list[str],
    set: Mapping[str, object] | None,
    estimators: Mapping[str, object] | None,
) -> tuple[NativeSeries, list[str]]: ...
def explain(
    path: str,
    seeds: list[int] | None,
    set: Mapping[str, object] | None,
    estimators: Mapping[str, object] | None,
    controller: object | None,
    in_loop: str | None,
) -> NativeSeries: ...
def inspect(log: str, time: str | None, unit: str | None, dbc: str | None) -> str: ...
def calibrate(
    map: str, log: str | None, with_mass: bool, set: Mapping[str, object] | None, put: bool
) -> str: ...
def tune(
    file: str,
    folder: str,
    cache: str,
    jobs: int,
    begin: str,
    progress: Callable[[str, float], None] | None,
) -> str: ...
