"""A study in shards with HyperQueue (`pip install hyperqueue`): no root, here on this machine, or on top of Slurm or PBS.

usage: hyperqueue_study.py STUDY OUT SHARDS [CORES]; MONORIG names the program.
"""

import os
import pathlib
import subprocess
import sys

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig

monorig = os.environ.get("MONORIG", "monorig")


def main(study: str, out: str, shards: int, cores: int) -> int:
    logs = pathlib.Path(out, "logs").absolute()
    logs.mkdir(parents=True, exist_ok=True)
    with LocalCluster() as cluster:
        cluster.start_worker(WorkerConfig(cores=cores))
        client = cluster.client()
        job = Job(max_fails=0)
        for k in range(1, shards + 1):
            job.program(
                [monorig, "study", study, "--shard", f"{k}/{shards}", "--expect", "merge", "--jobs", "1", "--out", out],
                stdout=str(logs / f"{k}.out"),
                stderr=str(logs / f"{k}.err"),
                cwd=os.getcwd(),
            )
        client.wait_for_jobs([client.submit(job)])  # raises if a shard failed
    parts = sorted(map(str, pathlib.Path(out).glob(f"*/results.*-of-{shards}.jsonl")))
    return subprocess.run([monorig, "merge", *parts, "--into", f"{out}/results.jsonl"]).returncode


if __name__ == "__main__":
    study, out, shards, *cores = sys.argv[1:]
    sys.exit(main(study, out, int(shards), int(cores[0]) if cores else os.cpu_count()))
