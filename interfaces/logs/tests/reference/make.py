"""Writes the logs in ../data with other people's libraries, and beside them what is in them.

usage: make.py [OUT | --check]; needs the packages of requirements.txt. The same seed gives the same bytes, but for the date in MDF, MAT and ASC;
--check makes them anew elsewhere and compares them with those that are committed.
"""

import csv
import json
import sys
import tempfile
from pathlib import Path

import can
import cantools
import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from asammdf import MDF, Signal
from mcap.writer import CompressionType, Writer
from mcap_ros2.writer import Writer as RosWriter
from scipy.io import savemat

COMMITTED = Path(__file__).parent.parent / "data"
CHECK = sys.argv[1:] == ["--check"]
TEMPORARY = tempfile.TemporaryDirectory()
OUT = Path(TEMPORARY.name if CHECK else sys.argv[1] if len(sys.argv) > 1 else COMMITTED)
OUT.mkdir(parents=True, exist_ok=True)
SECONDS = 1.0
START_NS = 1_700_000_000_000_000_000
rng = np.random.default_rng(7)


def stamps(rate_hz, jitter_us=0, first_us=0):
    """Whole microseconds, as ns."""
    n = int(SECONDS * rate_hz)
    us = first_us + np.round(np.arange(n) * 1e6 / rate_hz).astype(np.int64)
    return (us + rng.integers(0, jitter_us + 1, n)) * 1000


# 200 Hz IMU with jitter, 100 Hz drive with a gap, 20 Hz clamp pressure
t_imu, t_drive, t_clamp = stamps(200, 200), np.delete(stamps(100, 0, 1000), np.arange(30, 40)), stamps(20)
s = t_imu * 1e-9
ax = 0.3 * np.sin(s) + 0.05 * rng.standard_normal(s.size)
ay = 0.02 * rng.standard_normal(s.size)
az = 9.81 + 0.05 * rng.standard_normal(s.size)
gy = 0.01 * np.cos(s) + 0.002 * rng.standard_normal(s.size)
s = t_drive * 1e-9
torque = (120 + 10 * np.sin(2 * s)).astype(np.float32).astype(float)
speed = 1.2 + 0.1 * np.sin(s)
raw_pressure = np.round((10 + 0.5 * np.sin(t_clamp * 1e-9)) / 0.01).astype(np.int16)
pressure = raw_pressure * 0.01


def expect(name, columns, stamps_ns, *values):
    with open(OUT / f"expected_{name}.csv", "w", newline="") as f:
        w = csv.writer(f, lineterminator="\n")
        w.writerow(["time_ns", *columns])
        for t, *row in zip(stamps_ns, *values):
            w.writerow([int(t), *[repr(float(x)) for x in row]])


expect("imu", ["ax", "ay", "az", "gy"], t_imu, ax, ay, az, gy)
expect("drive", ["torque", "speed"], t_drive, torque, speed)
expect("clamp", ["pressure"], t_clamp, pressure)

# ---- MDF 4 by asammdf -----------------------------------------------------------------------------------------------------
for version in ("4.10", "4.20"):
    for compression, label in ((0, "plain"), (1, "deflate"), (2, "transposed")):
        with MDF(version=version) as m:
            imu = [("ax", ax, "m/s²"), ("ay", ay, "m/s²"), ("az", az, "m/s²"), ("gy", gy, "rad/s")]
            m.append([Signal(samples=v, timestamps=t_imu * 1e-9, name=n, unit=u) for n, v, u in imu], comment="imu", common_timebase=True)
            m.append(
                [
                    Signal(samples=torque.astype(np.float32), timestamps=t_drive * 1e-9, name="torque", unit="Nm"),
                    Signal(samples=speed, timestamps=t_drive * 1e-9, name="speed", unit="m/s"),
                ],
                common_timebase=True,
            )
            # whole numbers with a linear conversion
            conversion = {"a": 0.01, "b": 0.0}
            m.append([Signal(samples=raw_pressure, timestamps=t_clamp * 1e-9, name="pressure", unit="MPa", conversion=conversion)])
            m.save(OUT / f"asammdf_{version.replace('.', '')}_{label}.mf4", overwrite=True, compression=compression)

# ---- CAN by cantools and python-can ---------------------------------------------------------------------------------------
DBC = """VERSION "monorig fixture"

NS_ :

BS_:

BU_: CRANE

BO_ 256 IMU_ACC: 8 CRANE
 SG_ Acc_X : 0|16@1- (0.001,0) [-32|32] "m/s2" Vector__XXX
 SG_ Acc_Y : 16|16@1- (0.001,0) [-32|32] "m/s2" Vector__XXX
 SG_ Acc_Z : 32|16@1- (0.001,0) [-32|32] "m/s2" Vector__XXX

BO_ 257 IMU_GYRO: 8 CRANE
 SG_ Gyro_Y : 7|16@0- (0.0001,0) [-3|3] "rad/s" Vector__XXX

BO_ 2566834946 DRIVE: 8 CRANE
 SG_ Unit M : 0|4@1+ (1,0) [0|15] "" Vector__XXX
 SG_ Torque1 m0 : 8|16@1- (0.1,0) [-3200|3200] "Nm" Vector__XXX
 SG_ Speed1 m0 : 31|12@0+ (0.001,0) [0|4] "m/s" Vector__XXX
 SG_ Torque2 m1 : 8|16@1- (0.1,5) [-3200|3200] "Nm" Vector__XXX

BO_ 259 CLAMP: 4 CRANE
 SG_ Clamp_p : 0|32@1- (1,0) [0|0] "MPa" Vector__XXX

SIG_VALTYPE_ 259 Clamp_p : 1;
"""
(OUT / "crane.dbc").write_text(DBC)
db = cantools.database.load_string(DBC, "dbc")
drive_id = 2566834946 & 0x1FFFFFFF
frames = []
for i, t in enumerate(t_imu):
    frames.append((t, 256, False, db.encode_message("IMU_ACC", {"Acc_X": ax[i], "Acc_Y": ay[i], "Acc_Z": az[i]})))
    frames.append((t + 20_000, 257, False, db.encode_message("IMU_GYRO", {"Gyro_Y": gy[i]})))
for i, t in enumerate(t_drive):
    frames.append((t, drive_id, True, db.encode_message(drive_id, {"Unit": 0, "Torque1": torque[i], "Speed1": speed[i]})))
    frames.append((t + 300_000, drive_id, True, db.encode_message(drive_id, {"Unit": 1, "Torque2": -torque[i]})))
for i, t in enumerate(t_clamp):
    frames.append((t, 259, False, db.encode_message("CLAMP", {"Clamp_p": pressure[i]})))
frames.append((t_clamp[-1] + 10_000, 0x7FF, False, b"\x01\x02"))  # of no message
frames.sort(key=lambda f: f[0])
decoded = {}
for t, i, _, data in frames:
    if i == 0x7FF:
        continue
    for name, value in db.decode_message(i, data).items():
        decoded.setdefault(name, []).append((t, value))
for name in ("Acc_X", "Acc_Z", "Gyro_Y", "Torque1", "Speed1", "Torque2", "Clamp_p"):
    expect(f"can_{name}", [name], *zip(*decoded[name]))
for ending, writer in {"log": can.CanutilsLogWriter, "asc": can.ASCWriter, "blf": can.BLFWriter}.items():
    with writer(OUT / f"can.{ending}") as log:
        for t, i, extended, data in frames:
            at = (START_NS + int(t)) * 1e-9
            log.on_message_received(can.Message(timestamp=at, arbitration_id=i, is_extended_id=extended, data=data, channel=0, is_rx=True))

# ---- MCAP by mcap and mcap_ros2 ---------------------------------------------------------------------------------------------
COMPRESSIONS = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}
for label, compression in COMPRESSIONS.items():
    with open(OUT / f"json_{label}.mcap", "wb") as f:
        w = Writer(f, compression=compression)
        w.start(profile="", library="monorig fixture")
        schema = w.register_schema("Imu", "jsonschema", json.dumps({"type": "object"}).encode())
        imu, drive = w.register_channel("/imu", "json", schema), w.register_channel("/drive", "json", 0)
        rows = [(int(t), imu, {"ax": ax[i], "ay": ay[i], "az": az[i], "gy": gy[i]}) for i, t in enumerate(t_imu)]
        rows += [(int(t), drive, {"motor": {"torque": [torque[i]]}, "speed": speed[i], "text": "x"}) for i, t in enumerate(t_drive)]
        for t, channel, message in sorted(rows, key=lambda r: r[0]):
            w.add_message(channel, START_NS + t, json.dumps(message).encode(), START_NS + t)
        w.finish()

HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""
VECTOR = """
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z"""
IMU = (
    """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance"""
    + HEADER
    + """
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w"""
    + VECTOR
)
JOINT = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort""" + HEADER
TWIST = (
    """std_msgs/Header header
geometry_msgs/Twist twist"""
    + HEADER
    + """
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular"""
    + VECTOR
)
LATE_NS = 2_000_000  # recorded so much after the stamp
for label, compression in COMPRESSIONS.items():
    with open(OUT / f"cdr_{label}.mcap", "wb") as f:
        w = RosWriter(f, compression=compression)
        imu = w.register_msgdef("sensor_msgs/msg/Imu", IMU)
        joint = w.register_msgdef("sensor_msgs/msg/JointState", JOINT)
        number = w.register_msgdef("std_msgs/msg/Float64", "float64 data")
        twist = w.register_msgdef("geometry_msgs/msg/TwistStamped", TWIST)

        def header(t):
            return {"stamp": {"sec": (START_NS + t) // 10**9, "nanosec": (START_NS + t) % 10**9}, "frame_id": "imu_link"}

        none = {"x": 0.0, "y": 0.0, "z": 0.0}
        rows = []
        for i, t in enumerate(t_imu.tolist()):
            message = {
                "header": header(t),
                "orientation": {**none, "w": 1.0},
                "orientation_covariance": [0.0] * 9,
                "angular_velocity": {**none, "y": gy[i]},
                "angular_velocity_covariance": [0.0] * 9,
                "linear_acceleration": {"x": ax[i], "y": ay[i], "z": az[i]},
                "linear_acceleration_covariance": [0.0] * 9,
            }
            rows.append((t, "/imu/data", imu, message))
        for i, t in enumerate(t_drive.tolist()):
            message = {"header": header(t), "name": ["left", "right"], "position": [], "velocity": [speed[i], -speed[i]], "effort": [torque[i], 1.0]}
            rows.append((t, "/joints", joint, message))
            rows.append((t, "/twist", twist, {"header": header(t), "twist": {"linear": {**none, "x": speed[i]}, "angular": none}}))
        for i, t in enumerate(t_clamp.tolist()):
            rows.append((t, "/pressure", number, {"data": pressure[i]}))
        for n, (t, topic, schema, message) in enumerate(sorted(rows, key=lambda r: r[0])):
            late = START_NS + t + LATE_NS
            w.write_message(topic=topic, schema=schema, message=message, log_time=late, publish_time=late, sequence=n)
        w.finish()

# ---- Parquet by pyarrow and pandas --------------------------------------------------------------------------------------------
for compression in ("none", "snappy", "zstd", "gzip"):
    table = pa.table({"timestamp": pa.array(t_imu, pa.duration("ns")), "ax": ax, "ay": ay, "az": az, "gy": gy, "label": ["x"] * len(ax)})
    pq.write_table(table, OUT / f"pyarrow_{compression}.parquet", compression=compression)
frame = pd.DataFrame({"time": pd.to_datetime(START_NS + t_drive, unit="ns"), "torque": torque, "speed": speed})
frame.loc[3, "speed"] = np.nan
frame.to_parquet(OUT / "pandas_datetime.parquet")

# ---- MAT by scipy, and of version 7.3 by h5py -------------------------------------------------------------------------------------
imu_s, drive_s = t_imu * 1e-9, t_drive * 1e-9
logged = {
    "t": imu_s,
    "acc": np.column_stack([ax, ay, az]),
    "gy": gy,
    "drive": {"stamp_ns": t_drive, "torque": torque.astype(np.float32), "speed": speed, "note": "a text"},
    "valve": {"Time": t_clamp * 1e-9, "Data": pressure[None, None, :]},
}
for name, packed in (("plain", False), ("deflate", True)):
    savemat(OUT / f"scipy_{name}.mat", logged, do_compression=packed, oned_as="column")


def put(group, variables):
    for name, value in variables.items():
        if isinstance(value, dict):
            put(group.create_group(name), value)
        elif not isinstance(value, str):
            packed = {"compression": "gzip", "chunks": True} if name != "torque" else {}
            made = group.create_dataset(name, data=np.atleast_2d(value.T), track_times=False, **packed)
            made.attrs["MATLAB_class"] = np.bytes_({"float32": "single", "int64": "int64"}.get(value.dtype.name, "double"))


with h5py.File(OUT / "h5py_73.mat", "w", userblock_size=512) as file:
    put(file, logged)
with open(OUT / "h5py_73.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")

# ---- CSV by pandas ------------------------------------------------------------------------------------------------------------
titles = {"ax": "Beschl. X [m/s²]", "gy": "Drehrate Y [rad/s]"}
frame = pd.DataFrame({"Zeit": [f"{t // 10**9}.{t % 10**9:09d}" for t in t_imu.tolist()], titles["ax"]: ax, titles["gy"]: gy})
frame.to_csv(OUT / "comma.csv", index=False)
frame.to_csv(OUT / "comma_bom.csv", index=False, encoding="utf-8-sig")
frame["Zeit"] = frame["Zeit"].str.replace(".", ",")
frame.to_csv(OUT / "semicolon_decimal_comma.csv", index=False, sep=";", decimal=",")
frame.to_csv(OUT / "semicolon_latin1.csv", index=False, sep=";", decimal=",", encoding="latin-1", lineterminator="\r\n")
frame.to_csv(OUT / "utf16.csv", index=False, encoding="utf-16")

# ---- against those that are committed -----------------------------------------------------------------------------------------
DATED = {".mf4": 16, ".mat": 24}  # most bytes of dates


def differing(path):
    """How many bytes of a file are others than in the one that is committed."""
    made, committed = path.read_bytes(), (COMMITTED / path.name).read_bytes()
    if path.suffix == ".asc":  # its first line is the date of today, as long as the milliseconds are
        made, committed = (text.split(b"\n", 1)[1] for text in (made, committed))
    return sum(a != b for a, b in zip(made, committed)) if len(made) == len(committed) else max(len(made), len(committed))


if CHECK:
    names = {path.name for path in OUT.iterdir()}
    assert names == {path.name for path in COMMITTED.iterdir()}, f"other files: {names ^ {p.name for p in COMMITTED.iterdir()}}"
    others = {path.name: differing(path) for path in sorted(OUT.iterdir())}
    wrong = {name: n for name, n in others.items() if n > DATED.get(Path(name).suffix, 0)}
    assert not wrong, f"bytes that differ: {wrong}"
    print(f"{len(names)} files are those that are committed")
