#!/usr/bin/env bash
# Views with shared light beside direct drawing on the device at hand: an orbit of VIEWS views in each of SIZES. Prints the plan of
# each run, with c and g_v, and the seconds until all views were received. The eight minutes are shared by all runs.
set -euo pipefail
cd "$(dirname "$0")/.."

views="${VIEWS:-290}"
sizes="${SIZES:-200x150 1280x720 1920x1080}"
scene="${SCENE:-tree-terrain-500k}"
lighting="soft 16, occlusion 16"
myriorama=target/release/myriorama
end=$((SECONDS + 480))
out="$(mktemp -d)"
trap 'kill "$up" 2> /dev/null || true; rm -rf "$out"' EXIT

"$myriorama" up --nodes 4 --no-viewer --listen 127.0.0.1:0 --scene "$scene" --lighting "$lighting" > "$out/up.log" &
up=$!
until grep -q 'http://' "$out/up.log"; do sleep 0.2; done
cat "$out/up.log"
address="$(grep -o 'http://[0-9.:]*' "$out/up.log" | head -n 1)"
for size in $sizes; do
    for policy in pipeline direct; do
        printf '\n%s, %s:\n' "$size" "$policy"
        timeout "$((end - SECONDS))" "$myriorama" view --coordinator "$address" --orbit "$views" --size "$size" \
            --policy "$policy" --out "$out/$size-$policy" || echo "not done within eight minutes"
    done
done
