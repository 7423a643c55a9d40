#!/bin/bash
# A study in shards with GNU parallel: on this machine, or on those of --sshlogin.
# usage: parallel.sh STUDY OUT SHARDS [options of parallel, such as --jobs 4 or --sshlogin host1,host2]
# MONORIG names the program. Started again, it goes on: finished shards cost a second, torn ones go on where they were.
set -euo pipefail
study=$1 out=$2 n=$3
shift 3
monorig=${MONORIG:-monorig}
parallel --halt soon,fail=1 --retries 3 "$@" \
  "$monorig" study "$study" --shard "{}/$n" --expect merge --jobs 1 --out "$out" ::: $(seq "$n") > /dev/null
exec "$monorig" merge "$out"/*/results.*-of-"$n".jsonl --into "$out/results.jsonl"
