"""A study in shards with Dask (`pip install "dask[distributed]"`): here a LocalCluster; SSHCluster, or SLURMCluster of dask-jobqueue, likewise.

usage: dask_study.py STUDY OUT SHARDS [WORKERS]; MONORIG names the program. A shard whose worker dies is made again.
"""

import os
import pathlib
import subprocess
import sys

from dask.distributed import Client, LocalCluster, as_completed

monorig = os.environ.get("MONORIG", "monorig")


def shard(study: str, part: str, out: str, folder: str) -> str:
    command = [monorig, "study", study, "--shard", part, "--expect", "merge", "--jobs", "1", "--out", out]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    return part


def main(study: str, out: str, shards: int, workers: int) -> int:
    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        parts = [f"{k}/{shards}" for k in range(1, shards + 1)]
        jobs = [client.submit(shard, study, part, out, os.getcwd(), pure=False, retries=2) for part in parts]
        for job in as_completed(jobs):
            job.result()
    files = sorted(map(str, pathlib.Path(out).glob(f"*/results.*-of-{shards}.jsonl")))
    return subprocess.run([monorig, "merge", *files, "--into", f"{out}/results.jsonl"]).returncode


if __name__ == "__main__":
    study, out, shards, *workers = sys.argv[1:]
    sys.exit(main(study, out, int(shards), int(workers[0]) if workers else os.cpu_count()))
