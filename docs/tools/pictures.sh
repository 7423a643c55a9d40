#!/usr/bin/env bash
# The pictures of the book, made anew: needs what docs/tools/screenshot.py, tab_picture.py and page_picture.sh need, and a built monorig.
#     docs/tools/pictures.sh [MONORIG]
set -euo pipefail
cd "$(dirname "$0")/../.."
monorig=$(realpath "${1:-target/release/monorig}") out=$(mktemp -d) images=docs/src/images
trap 'rm -rf "$out"' EXIT
ran() { # scenario
  "$monorig" run "scenarios/$1.yaml" --out "$out" || test $? = 1
}
picture() { # scenario, picture, seconds to wait
  ran "$1"
  python3 docs/tools/screenshot.py "$out/$1/1/run.rrd" "$images/$2" --wait "$3"
}
picture liu2023_section1 run.png 60
picture liu2023_vehicle_test overview.png 100
picture guo2024_5_turning car.png 25
python3 docs/tools/tab_picture.py "$out/liu2023_vehicle_test/1/run.rrd" "$images/filters.png" Filters
"$monorig" report "$out/liu2023_section1/1"
docs/tools/page_picture.sh "$out/liu2023_section1/1/report.html" "$images/report.png" 1280 1180
