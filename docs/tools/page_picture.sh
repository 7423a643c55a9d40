#!/usr/bin/env bash
# A picture of the top of an HTML page: page_picture.sh PAGE PICTURE [WIDTH HEIGHT]. Needs chromium (apt-get install chromium).
set -euo pipefail
page=$(realpath "$1") picture=$(realpath -m "$2")
exec chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --no-first-run \
  --window-size="${3:-1280},${4:-1000}" --screenshot="$picture" "file://$page"
