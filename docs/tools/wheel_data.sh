#!/usr/bin/env bash
# Puts what a wheel has beside the module where maturin takes it from: program, share folder, licences of what is linked.
#   docs/tools/wheel_data.sh target/release [PYTHON]
set -Eeuo pipefail
cd "$(dirname "$0")/../.."
built=$1
python=${2:-python3}
data=interfaces/python/monorig._monorig.data
if ! ls "$built"/*monorig_c.* >/dev/null 2>&1; then
  echo "error: $built has no library for C; help: cargo build --release" >&2
  exit 1
fi
rm -rf "$data"
mkdir -p "$data/scripts" "$data/data/share"
for program in "$built/monorig" "$built/monorig.exe"; do
  if [ -f "$program" ]; then cp "$program" "$data/scripts"; fi
done
"$python" docs/tools/share.py "$data/data/share/monorig" "$built"
notices=$data/data/share/monorig/licenses/THIRD-PARTY.txt
"$python" docs/tools/licences.py "$notices" monorig monorig-python monorig-c monorig-fmu
cp "$notices" interfaces/python/LICENSES-THIRD-PARTY.txt
if [ "$(uname -s)" = Linux ]; then
  strip "$data"/scripts/* "$data"/data/share/monorig/lib/*.so*
fi
