"""FMPy validates every FMU of ours and runs it: the estimates are those of a run of monorig, to the last bit.

usage: check.py MONORIG OUT [NAME ...]   program, empty folder, estimators (without: all)
"""

import os
import pathlib
import subprocess
import sys
import sysconfig

import numpy
import pyarrow.parquet
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

SCENARIO = "scenarios/minimal.yaml"
SECONDS = 6
STANDARDS = (2, 3)
OUTPUTS = [q + s for q in ("total_mass", "grade", "effective_grade", "speed") for s in ("", "_sd")] + ["innovation", "nis"]
FLAGS = ["total_mass_valid", "grade_valid", "effective_grade_valid", "moving", "excited", "saturated"]

program, out, *names = sys.argv[1:]
out = pathlib.Path(out)
out.mkdir(parents=True, exist_ok=True)


def monorig(*words: str) -> str:
    done = subprocess.run([program, "-q", *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"monorig {' '.join(map(str, words))}: {done.stderr}")
    return done.stdout


class Fmu:
    """An FMU of either standard, by the names of its variables."""

    def __init__(self, file: pathlib.Path, standard: int, **start: float) -> None:
        about = read_model_description(str(file))
        self.references = {v.name: v.valueReference for v in about.modelVariables}
        of = FMU2Slave if standard == 2 else FMU3Slave
        token = about.guid if standard == 2 else about.instantiationToken
        self.fmu = of(
            guid=token,
            unzipDirectory=extract(str(file)),
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=file.stem,
        )
        self.fmu.instantiate()
        two = standard == 2
        self.set_reals, self.get_reals = (self.fmu.setReal, self.fmu.getReal) if two else (self.fmu.setFloat64, self.fmu.getFloat64)
        if two:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in start.items():
            self.fmu.setBoolean([self.references[name]], [value])
        self.fmu.exitInitializationMode()

    def set(self, values: dict[str, float]) -> None:
        self.set_reals([self.references[name] for name in values], list(values.values()))

    def get(self, names: list[str]) -> list[float]:
        return list(self.get_reals([self.references[name] for name in names]))

    def flags(self, names: list[str]) -> list[bool]:
        return [bool(x) for x in self.fmu.getBoolean([self.references[name] for name in names])]

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def name_of(column: str) -> str:
    """Name of an input of an FMU for a column of samples.parquet."""
    stem, _, part = column.partition(".")
    stamp = "_t" if part == "stamp_ns" else ""
    if stem == "command":
        part = part.replace("torque_", "motor_torque_")
        head, _, number = part.rpartition("_")
        return f"command_{head}[{number}]" if number.isdigit() else f"command_{part}"
    head, _, number = stem.rpartition("_")
    if number.isdigit():
        return f"{head}{stamp}[{number}]"
    return stem + (stamp or (f"_{part}" if part else ""))


if not names:
    # descriptions are indented
    names = [line.strip() for line in monorig("list", "estimators").splitlines() if line and not line[0].isspace()]

# an FMU is told the true values of the vehicle: so is the run
EXACT = ("--set", "vehicle.exact.all=an FMU is told exactly")

# the estimators in a run: samples and estimates
sets = [word for name in names for word in ("--set", f"estimators.{name}={{}}")]
monorig("run", SCENARIO, "--keep-samples", "--no-rerun", "--set", f"stop.after_s={SECONDS}", "--set", "record.rate_hz=250",
        "--set", "expect=[]", "--set", "availability={}", *EXACT, *sets, "--name", "fmpy", "--out", out / "run")
folder = next((out / "run").rglob("samples.parquet")).parent
samples = pyarrow.parquet.read_table(folder / "samples.parquet").to_pydict()
channels = pyarrow.parquet.read_table(folder / "channels.parquet")
times = numpy.rint(numpy.asarray(channels["time"]) * 1e9).astype("int64")
rows = {int(t): i for i, t in enumerate(times)}
inputs = {column: name_of(column) for column in samples if column != "arrival_ns" and not column.startswith("truth.")}

problems = 0
compared = 0
for name in names:
    wanted = {o: numpy.asarray(channels[f"estimates/{name}/{o}"]) for o in OUTPUTS + FLAGS if f"estimates/{name}/{o}" in channels.column_names}
    for standard in STANDARDS:
        file = out / f"{name}_{standard}.fmu"
        monorig("fmu", "estimator", name, "--scenario", SCENARIO, "--fmi", standard, "--out", file)
        for problem in validate_fmu(str(file)):
            problems += 1
            print(f"{file.name}: {problem}")
        fmu = Fmu(file, standard, stamped=True)
        there = {column: name_ for column, name_ in inputs.items() if name_ in fmu.references}
        last, wrong = 0, 0
        for i, now in enumerate(samples["arrival_ns"]):
            new, sampled = {}, False
            for column, name_ in there.items():
                x = samples[column][i]
                if x is not None:
                    sampled |= column.endswith("stamp_ns")
                    new[name_] = x / 1e9 if column.endswith("stamp_ns") else x
            fmu.set(new)
            if not sampled:
                continue  # the command alone has changed: no step of the estimators
            dt = now * 1e-9 - last * 1e-9  # as the loop reckons
            fmu.fmu.doStep(last * 1e-9, dt)
            last = now
            if now in rows:
                row = rows[now]
                got = fmu.get([o for o in OUTPUTS if o in wanted])
                expected = [float(wanted[o][row]) for o in OUTPUTS if o in wanted]
                flags = fmu.flags([f for f in FLAGS if f in wanted])
                marks = [bool(wanted[f][row]) for f in FLAGS if f in wanted]
                compared += 1
                if numpy.array(got).tobytes() != numpy.array(expected).tobytes() or flags != marks:
                    wrong += 1
                    if wrong == 1:
                        print(f"{file.name}: at {now / 1e9} s {got} {flags} and not {expected} {marks}")
        problems += wrong
        fmu.close()
        file.unlink()

# an FMU of somebody else, made by PythonFMU: in monorig it gives what it gives in FMPy. It needs the library of Python
# beside it, which no program of C has
FOREIGN = """
import math
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Slope(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.specific_force_x = self.grade = 0.0
        self.register_variable(Real("specific_force_x", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("grade", causality=Fmi2Causality.output))

    def do_step(self, time, dt):
        self.grade += 0.5 * dt * (math.asin(max(-1.0, min(1.0, self.specific_force_x / 9.81))) - self.grade)
        return True
"""
python = pathlib.Path(sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("INSTSONAME"))
foreign = "no FMU of PythonFMU: Python is no shared library here"
if sys.platform == "linux" and python.suffix != ".a" and python.exists():
    (out / "slope.py").write_text(FOREIGN)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", out / "slope.py", "-d", out, "--no-external-tool"]
    subprocess.run(build, check=True)
    os.environ |= {"LD_PRELOAD": str(python), "PYTHONPATH": sysconfig.get_path("purelib")}
    mine = f"estimators={{mine: {{fmu: {out.resolve() / 'Slope.fmu'}, map: {{grade_sd: 0.01}}}}}}"
    monorig("run", SCENARIO, "--no-rerun", "--set", f"stop.after_s={SECONDS}", "--set", "record.rate_hz=250", "--set", "expect=[]",
            "--set", "availability={}", *EXACT, "--set", mine, "--name", "foreign", "--out", out / "foreign")
    del os.environ["LD_PRELOAD"], os.environ["PYTHONPATH"]
    wanted = pyarrow.parquet.read_table(next((out / "foreign").rglob("channels.parquet")))["estimates/mine/grade"].to_pylist()
    fmu = Fmu(out / "Slope.fmu", 2)
    last, wrong, same = 0, 0, 0
    stamps = [column for column in samples if column.endswith(".stamp_ns")]
    for i, now in enumerate(samples["arrival_ns"]):
        if samples["specific_force.x"][i] is not None:
            fmu.set({"specific_force_x": samples["specific_force.x"][i]})
        if any(samples[stamp][i] is not None for stamp in stamps):
            fmu.fmu.doStep(last * 1e-9, now * 1e-9 - last * 1e-9)
            last = now
            if now in rows:
                right = fmu.get(["grade"])[0] == wanted[rows[now]]
                wrong, same = wrong + (not right), same + right
    fmu.close()
    problems += wrong + (same == 0)
    foreign = f"an FMU of PythonFMU, {same} estimates the same and {wrong} not"

# the plant: both standards make the same
ends = []
for standard in STANDARDS:
    file = out / f"plant_{standard}.fmu"
    monorig("fmu", "plant", SCENARIO, "--fmi", standard, "--out", file)
    for problem in validate_fmu(str(file)):
        problems += 1
        print(f"{file.name}: {problem}")
    fmu = Fmu(file, standard)
    truth = [n for n in fmu.references if n.startswith("truth.") or n.startswith("specific_force")]
    series = []
    for step in range(500):
        fmu.set({n: 10.0 for n in fmu.references if n.startswith("command_motor_torque")} | {"command_clamp_pressure": 8.0})
        fmu.fmu.doStep(step * 0.012, 0.012)
        series.append(fmu.get(truth))
    fmu.close()
    ends.append(numpy.array(series).tobytes())
if ends[0] != ends[1]:
    problems += 1
    print("the plant differs between FMI 2.0 and 3.0")

print(f"{len(names)} estimators and the plant in FMI 2.0 and 3.0, {compared} estimates compared; {foreign}: {problems} problems")
sys.exit(problems > 0 or compared == 0)
