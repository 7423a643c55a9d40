"""Random MAT files by scipy, plain and compressed, and of version 7.3 by h5py, with the values that are in them.

    python interfaces/logs/tests/reference/mat_of_scipy.py FOLDER
    MONORIG_MAT_FOLDER=FOLDER cargo test --release --tests -- --ignored mat_files_of_scipy

For each file FOLDER gets NAME.mat and NAME.csv: stamp in ns, `struct.column`, the bits of the value as a double.
"""

import sys
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

FILES = 60
KINDS = [np.float64, np.float32, np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.bool_]
TIMES = [("t", 1.0), ("time", 1.0), ("Time", 1.0), ("t_ms", 1e3), ("timestamp_ns", 1e9)]

folder = Path(sys.argv[1])
folder.mkdir(parents=True)
rng = np.random.default_rng(5)


def oriented(x):
    """As a row or as a column."""
    return x[:, None] if rng.integers(2) else x[None, :]


def table(group, rows):
    """Random variables of one struct, with its time."""
    ns = np.sort(rng.choice(10**6, rows, replace=False)).astype(np.int64) * 1000
    name, per_second = TIMES[rng.integers(len(TIMES))]
    time = ns if per_second == 1e9 else ns / 1e9 * per_second
    made = {name: oriented(time)}
    for k in range(rng.integers(1, 6)):
        kind = KINDS[rng.integers(len(KINDS))]
        bits = rng.integers(0, 2**63, (rows, 3), dtype=np.int64)
        if kind in (np.float64, np.float32):
            values = (rng.standard_normal((rows, 3)) * 10.0 ** rng.integers(-30, 30)).astype(kind)
        else:
            values = (bits % 2).astype(bool) if kind is np.bool_ else bits.astype(kind)
        column = f"signal_{k}" + "x" * int(rng.integers(0, 20))
        shape = rng.integers(4)
        if shape == 0:  # a matrix with a row for each time
            made[column] = values
        elif shape == 1:  # a column for each time, as Simulink writes vectors
            made[column] = np.ascontiguousarray(values.T)[:, None, :]
        else:
            values = values[:, :1]
            made[column] = oriented(values[:, 0])
        for c in range(values.shape[1]):
            title = column if values.shape[1] == 1 else f"{column}_{c + 1}"
            for t, x in zip(ns, values[:, c]):
                rows_of_file.append(f"{t},{group}{title},{int(np.float64(x).view(np.uint64))}\n")
    made["note"], made["gain"], made["cells"] = "a text", 2.5, np.array([1, "two"], dtype=object)
    return made


def put(group, variables):
    """Variables as MATLAB has them in HDF5: sizes in the other order, the class as an attribute."""
    for name, value in variables.items():
        if isinstance(value, dict):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            put(inner, value)
        elif isinstance(value, np.ndarray) and value.dtype != object:
            number = value.astype(np.uint8) if value.dtype == bool else value
            packed = {"compression": "gzip", "shuffle": True, "chunks": True} if rng.integers(2) else {}
            names = {"float64": "double", "float32": "single", "bool": "logical"}
            made = group.create_dataset(name, data=number.T, **packed)
            made.attrs["MATLAB_class"] = np.bytes_(names.get(value.dtype.name, value.dtype.name))
        elif isinstance(value, str):
            made = group.create_dataset(name, data=np.array([[ord(c)] for c in value], dtype=np.uint16))
            made.attrs["MATLAB_class"] = np.bytes_("char")


def values_of(number):
    """The variables of a file: at the top level, in structs, or a struct within one."""
    rows = int(rng.integers(5, 200))  # more than any other size of a variable
    top = table("", rows) if number % 3 != 1 else {"comment": "only structs"}
    if number % 3 != 0:
        top["log"] = table("log.", int(rng.integers(5, 200)))
        top["log"]["imu"] = table("log.imu.", int(rng.integers(5, 200)))
    return top


for number in range(FILES):
    rows_of_file = []
    variables, path = values_of(number), folder / f"{number:03d}.mat"
    if number % 4 == 3:
        with h5py.File(path, "w", userblock_size=512) as file:
            put(file, variables)
        with open(path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    else:
        savemat(path, variables, do_compression=number % 2 == 0, long_field_names=True, oned_as="column")
    path.with_suffix(".csv").write_text("".join(rows_of_file))
print(f"{FILES} files")
