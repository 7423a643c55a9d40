"""Reads what `monorig log export` wrote with other people's libraries, and holds every value and every stamp against `samples.parquet` of the run:
exactly, and of CAN within half a step of each signal and of the stamp.

usage: read_ours.py RUN EXPORTS; RUN is a folder of `monorig run --keep-samples`, EXPORTS has the folders csv, parquet, mat, mcap, mf4 and can of
`monorig log export RUN --to FORMAT --out EXPORTS/FORMAT`. Needs the packages of requirements.txt.
"""

import json
import re
import sys
from pathlib import Path

import can
import cantools
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from asammdf import MDF
from mcap.reader import make_reader
from scipy.io import loadmat


class Table:
    """Rows of a table: when they arrived and were taken (ns), and their values; NaN where there is none."""

    def __init__(self, columns, arrival, stamp, values):
        self.columns = list(columns)
        self.arrival = np.asarray(arrival, dtype=np.int64)
        self.stamp = np.asarray(stamp, dtype=np.int64)
        self.values = np.asarray(values, dtype=np.float64).reshape(len(self.arrival), len(self.columns))


def expected(run):
    """The tables of a run, from its kept samples."""
    kept = pq.read_table(run / "samples.parquet")
    column = {name: kept.column(name) for name in kept.column_names}
    whole = {n: c.fill_null(0).to_numpy() for n, c in column.items() if n.endswith("_ns")}
    there = {n: ~c.is_null().to_numpy() for n, c in column.items()}
    number = {n: c.cast("float64").fill_null(float("nan")).to_numpy() for n, c in column.items() if not n.endswith("_ns")}
    arrival = whole["arrival_ns"]
    tables = {}
    for name in ("specific_force", "angular_rate"):
        rows = there[f"{name}.stamp_ns"]
        if rows.any():
            values = np.column_stack([number[f"{name}.{axis}"] for axis in "xyz"])
            tables[name] = Table("xyz", arrival[rows], whole[f"{name}.stamp_ns"][rows], values[rows])
    for name in ("motor_torque", "wheel_speed", "clamp_pressure"):
        drives = sorted(int(m[1]) for n in column if (m := re.fullmatch(rf"{name}_(\d+)", n)))
        rows = {}
        for place, i in enumerate(drives):
            for k in np.flatnonzero(there[f"{name}_{i}.stamp_ns"]):
                # in a step a row for each instant at which values were taken
                row = rows.setdefault((k, whole[f"{name}_{i}.stamp_ns"][k]), np.full(len(drives), np.nan))
                row[place] = number[f"{name}_{i}"][k]
        if rows:
            keys = sorted(rows)
            columns = [f"drive_{i}" for i in drives]
            tables[name] = Table(columns, [arrival[k] for k, _ in keys], [t for _, t in keys], [rows[key] for key in keys])
    drives = sorted(int(m[1]) for n in column if (m := re.fullmatch(r"command\.torque_(\d+)", n)))
    rows = there["command.brake"]
    if rows.any():
        names = [f"command.torque_{i}" for i in drives] + ["command.clamp_pressure", "command.brake"]
        columns = [f"drive_{i}" for i in drives] + ["clamp_pressure", "brake"]
        tables["command"] = Table(columns, arrival[rows], arrival[rows], np.column_stack([number[n] for n in names])[rows])
    slopes = np.column_stack([number["truth.slope"], number["truth.effective_slope"]])
    tables["truth"] = Table(["slope", "effective_slope"], arrival, arrival, slopes)
    return tables


def bits(a):
    """The bits of numbers: whatever is no number is the same."""
    return np.where(np.isnan(a), np.nan, a).view(np.uint64)


def same(what, name, table, columns, arrival, stamp, values):
    """That what was read is the table, bit for bit."""
    read = Table(columns, arrival, stamp, values)
    assert read.columns == table.columns, f"{what}: columns of {name}: {read.columns}, written {table.columns}"
    assert len(read.arrival) == len(table.arrival), f"{what}: {name} has {len(read.arrival)} rows, written {len(table.arrival)}"
    for word, a, b in (("arrival", read.arrival, table.arrival), ("stamp", read.stamp, table.stamp)):
        assert (a == b).all(), f"{what}: {word} of {name}, row {np.flatnonzero(a != b)[0]}"
    other = bits(read.values) != bits(table.values)
    assert not other.any(), f"{what}: values of {name}, row and column {np.argwhere(other)[0]}"


def csv(folder, tables):
    """pandas."""
    for name, table in tables.items():
        frame = pd.read_csv(folder / f"{name}.csv")
        columns = frame.columns[2:]
        same("csv", name, table, columns, frame["arrival_ns"], frame["stamp_ns"], frame[columns].to_numpy(dtype=float))


def parquet(folder, tables):
    """pandas over pyarrow, and the units by pyarrow."""
    for name, table in tables.items():
        path = folder / f"{name}.parquet"
        frame = pd.read_parquet(path)
        columns = frame.columns[2:]
        same("parquet", name, table, columns, frame["arrival_ns"], frame["stamp_ns"], frame[columns].to_numpy(dtype=float))
        fields = pq.read_schema(path)
        assert all(fields.field(c).metadata[b"unit"] for c in columns), f"parquet: a column of {name} has no unit"


def mat(folder, tables):
    """scipy; beside the tables the channels of the run, by their names."""
    (path,) = folder.glob("*.mat")
    file = loadmat(path)
    for name, table in tables.items():
        struct, units, names = (s[name][0, 0] for s in (file, file["units"][0, 0], file["names"][0, 0]))
        columns = [c for c in struct.dtype.names if c not in ("t_s", "arrival_ns", "stamp_ns")]
        times = [struct[t] for t in ("arrival_ns", "stamp_ns")]
        assert all(t.dtype == np.int64 and t.shape[1] == 1 for t in times), f"mat: times of {name}"
        assert (struct["t_s"] == times[0] / 1e9).all(), f"mat: t_s of {name}"
        same("mat", name, table, columns, times[0][:, 0], times[1][:, 0], np.column_stack([struct[c] for c in columns]))
        assert all(units[c].item() and names[c].item() == c for c in columns), f"mat: a column of {name} has no unit or name"
    kept, struct = pq.read_table(run / "channels.parquet"), file["channels"][0, 0]
    assert [file["names"][0, 0]["channels"][0, 0][c].item() for c in struct.dtype.names] == kept.column_names, "mat: channels"
    units = file["units"][0, 0]["channels"][0, 0]
    for field, column in zip(struct.dtype.names, kept.column_names):
        assert "".join(units[field]).encode() == kept.schema.field(column).metadata[b"unit"], f"mat: unit of {column}"
        written = kept.column(column).fill_null(float("nan")).to_numpy()
        assert (bits(struct[field][:, 0]) == bits(written)).all(), f"mat: {column}"


def mcap(folder, tables):
    """The reader of the mcap package; the columns of a topic are those of its schema."""
    (path,) = folder.glob("*.mcap")
    topics = {}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            properties = json.loads(schema.data)["properties"]
            topics.setdefault(channel.topic, (properties, []))[1].append((message, json.loads(message.data)))
    assert set(topics) == {f"/{name}" for name in tables}, f"mcap: topics {sorted(topics)}"
    for name, table in tables.items():
        properties, rows = topics[f"/{name}"]
        columns = [c for c in properties if c != "stamp_ns"]
        # the schema is an object: its keys have no order that counts
        assert set(columns) == set(table.columns), f"mcap: columns of {name}"
        values = [[row.get(c, np.nan) for c in table.columns] for _, row in rows]
        same("mcap", name, table, table.columns, [m.log_time for m, _ in rows], [row["stamp_ns"] for _, row in rows], values)
        published = [m.publish_time for m, _ in rows]
        assert published == [max(0, t) for t in table.stamp], f"mcap: times of publication of {name}"


def mf4(folder, tables):
    """asammdf; arrival is the master channel, in seconds."""
    (path,) = folder.glob("*.mf4")
    with MDF(path) as file:
        groups = {}
        for i, group in enumerate(file.groups):
            names = [c.name for c in group.channels]
            groups[next(n.split(".")[0] for n in names if "." in n)] = (i, [n for n in names if "." in n])
        assert set(groups) == set(tables), f"mf4: groups {sorted(groups)}"
        for name, table in tables.items():
            group, names = groups[name]
            signals = [file.get(n, group=group) for n in names]
            stamps = file.get("stamp_ns", group=group)
            assert stamps.samples.dtype == np.int64
            assert (signals[0].timestamps == table.arrival / 1e9).all(), f"mf4: arrival of {name}"
            arrival = np.round(signals[0].timestamps * 1e9).astype(np.int64)
            columns = [n.split(".", 1)[1] for n in names]
            same("mf4", name, table, columns, arrival, stamps.samples, np.column_stack([s.samples for s in signals]))
            assert all(s.unit for s in signals), f"mf4: a channel of {name} has no unit"


def bus(folder, tables):
    """python-can and cantools: raw numbers within half a step of what was written, stamps within half a microsecond."""
    (log,), (dbc,) = folder.glob("*.log"), folder.glob("*.dbc")
    database = cantools.database.load_file(dbc)
    frames = {}
    for frame in can.CanutilsLogReader(log):
        message = database.get_message_by_frame_id(frame.arbitration_id)
        decoded = message.decode(bytes(frame.data), scaling=False)
        frames.setdefault(message.name, []).append((round(frame.timestamp * 1e9), decoded))
    for name, table in tables.items():
        vector = name in ("specific_force", "angular_rate")
        for group in [table.columns] if vector else [[c] for c in table.columns]:
            title = name if vector else f"{name}_{group[0]}"
            message, rows = database.get_message_by_name(title), frames.pop(title, [])
            places = [table.columns.index(c) for c in group]
            written = ~np.isnan(table.values[:, places]).any(axis=1)
            assert len(rows) == written.sum(), f"can: {title} has {len(rows)} frames, written {written.sum()}"
            if not rows:
                continue
            assert ([t for t, _ in rows] == table.arrival[written]).all(), f"can: arrival of {title}"
            stamps = np.array([row["stamp_us"] for _, row in rows])
            assert (np.abs(stamps * 1000 - table.stamp[written]) <= 500).all(), f"can: stamps of {title}"
            for column, place in zip(group, places):
                signal = message.get_signal_by_name(column)
                most = 2 ** (signal.length - 1) - 1
                exact = np.clip(table.values[written, place] / float(signal.scale), -most, most)
                off = np.abs(np.array([row[column] for _, row in rows]) - exact)
                # 1e-9 of a step for the division
                assert (off <= 0.5 + 1e-9).all(), f"can: {title}.{column} is off by {off.max()} steps"
                assert signal.unit, f"can: {title}.{column} has no unit"
    assert not frames, f"can: messages that were not written: {sorted(frames)}"


run, exports = Path(sys.argv[1]), Path(sys.argv[2])
all_tables = expected(run)
for reader, folder in ((csv, "csv"), (parquet, "parquet"), (mat, "mat"), (mcap, "mcap"), (mf4, "mf4"), (bus, "can")):
    reader(exports / folder, all_tables)
    print(f"{folder}: {sum(t.values.size for t in all_tables.values())} values of {len(all_tables)} tables are those of the run")
