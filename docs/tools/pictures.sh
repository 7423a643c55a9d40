#!/usr/bin/env bash
# Pictures of recordings in the book, made anew: needs what docs/tools/screenshot.py needs, and a built monorig.
#     docs/tools/pictures.sh [MONORIG]
set -euo pipefail
cd "$(dirname "$0")/../.."
monorig=${1:-target/release/monorig} out=$(mktemp -d) images=docs/src/images
trap 'rm -rf "$out"' EXIT
picture() { # scenario, picture, seconds to wait
  "$monorig" run "scenarios/$1.yaml" --out "$out" || test $? = 1
  python3 docs/tools/screenshot.py "$out/$1/1/run.rrd" "$images/$2" --wait "$3"
}
picture adhesion_loss run.png 50
picture guo2024_5_turning car.png 25
