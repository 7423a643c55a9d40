"""Random frames of every DBC file in the sources of cantools, with the values that cantools decodes.

    python interfaces/logs/tests/reference/dbc_of_cantools.py FOLDER
    MONORIG_DBC_FOLDER=FOLDER cargo test --release --tests -- --ignored dbc_files_of_cantools

For each file FOLDER gets NAME.dbc, NAME.log (candump) and NAME.csv: stamp in ns, `message.signal`, value. Files that
cantools refuses, and messages that it cannot decode, are counted and left out.
"""

import math
import random
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import cantools

START_NS = 1_700_000_000_000_000_000
FRAMES = 6

folder = Path(sys.argv[1])
folder.mkdir(parents=True)
version = f"cantools=={cantools.__version__}"
subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:", version, "--dest", folder], check=True)
(archive,) = folder.glob("cantools-*.tar.gz")
with tarfile.open(archive) as sources:
    sources.extractall(folder / "sources", filter="data")

random.seed(1)
files = signals = refused = 0
for path in sorted((folder / "sources").rglob("*.dbc")):
    try:
        database = cantools.database.load_file(path)
    except Exception:
        refused += 1
        continue
    frames, rows, at = [], [], START_NS
    for message in database.messages:
        for _ in range(FRAMES):
            data = random.randbytes(message.length)
            try:
                values = message.decode(data, decode_choices=False)
            except Exception:
                continue
            at += 1_000_000
            name = f"{message.frame_id:08X}" if message.is_extended_frame else f"{message.frame_id:03X}"
            mark = "##0" if message.length > 8 else "#"
            frames.append(f"({at // 10**9}.{at % 10**9 // 1000:06d}) can0 {name}{mark}{data.hex().upper()}\n")
            for signal, value in values.items():
                if isinstance(value, (int, float)) and math.isfinite(value):
                    rows.append(f"{at},{message.name}.{signal},{float(value)!r}\n")
    if not rows:
        continue
    stem = f"{files:03d}_{path.stem}"
    shutil.copy(path, folder / f"{stem}.dbc")
    (folder / f"{stem}.log").write_text("".join(frames))
    (folder / f"{stem}.csv").write_text("".join(rows))
    files += 1
    signals += len({row.split(",")[1] for row in rows})
print(f"{files} files with {signals} signals; {refused} refused by cantools")
