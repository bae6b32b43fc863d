#!/usr/bin/env bash
# Starts the cluster of deploy/compose.yaml, waits until all services are healthy, and requests 24 views of each scene,
# which must agree with direct rendering. With --test images omit what others cover; it also kills nodes while both scenes are
# watched, and then stops the cluster.
#
# The program is expected at target/release/myriorama, or at $MYRIORAMA.
set -euo pipefail
cd "$(dirname "$0")/.."

program="${MYRIORAMA:-target/release/myriorama}"
coordinator=http://127.0.0.1:7420
services=(coordinator node-1 node-2 node-3 node-4)
scenes=("${MYRIORAMA_SCENE:-courtyard}" "${MYRIORAMA_OTHER_SCENE:-mirror-hall}")

compose() {
    if docker compose version >/dev/null 2>&1; then
        docker compose --project-name myriorama --file deploy/compose.yaml "$@"
    else
        docker-compose --project-name myriorama --file deploy/compose.yaml "$@"
    fi
}

build() {
    local base context
    base="$(deploy/base-image.sh)"
    context="$(mktemp -d)"
    cp "$program" "$context/myriorama"
    docker build --quiet --build-arg "BASE=$base" --file deploy/Dockerfile --tag myriorama:local "$context" >/dev/null || {
        rm -rf "$context"
        return 1
    }
    rm -rf "$context"
    # A program built against a later libc than the image's does not start there.
    docker run --rm myriorama:local --version
}

health_of() {
    docker inspect --format '{{.State.Health.Status}}' "$(compose ps --quiet "$1")" 2>/dev/null || echo missing
}

wait_until_healthy() {
    local service deadline=$((SECONDS + 120))
    for service in "$@"; do
        until [ "$(health_of "$service")" = healthy ]; do
            if [ "$SECONDS" -gt "$deadline" ]; then
                echo "$service is not healthy:" >&2
                compose logs --tail 20 "$service" >&2
                exit 1
            fi
            sleep 0.5
        done
        echo "$service is healthy"
    done
}

views() {
    local at
    for at in 0 1; do
        "$program" view --coordinator "$coordinator" --scene "${scenes[at]}" --views 24 --policy pipeline --compare \
            --out "out/cluster/scene-$at"
        # The worst PSNR of whole pictures, in dB.
        awk -F, '$1 == "worst" { found = $5 >= 24 } END { exit !found }' "out/cluster/scene-$at/comparison.csv"
    done
}

# Expensive light and few views: several nodes sample, each image without what others cover.
sampled_by_several() {
    "$program" view --coordinator "$coordinator" --scene "${scenes[0]}" --views 4 --policy pipeline \
        --lighting 'soft 16, indirect 64' --compare --out out/cluster/sampled-by-several | tee out/cluster/plan.txt
    grep -q 'sampled by K = [2-4] of 4 nodes' out/cluster/plan.txt
    awk -F, '$1 == "worst" { found = $5 >= 30 } END { exit !found }' out/cluster/sampled-by-several/comparison.csv
}

# A viewer of scene $1 for 20 s, which may see no new picture for $2 seconds; its output is in $3.
watch_scene() {
    "$program" view --coordinator "$coordinator" --scene "$1" --orbit 120 --size 160x120 --policy pipeline --live \
        --rate 10 --seconds 20 --out "$3"
    awk -F, -v longest="$2" 'NR > 1 { if ($3 - last > gap) gap = $3 - last; last = $3 }
        END { if (20 - last > gap) gap = 20 - last; exit !(NR > 1 && gap <= longest) }' "$3/live.csv"
}

status() {
    "$program" status --coordinator "$coordinator"
}

# The nodes of the first or second open workload, one a line.
nodes_of() {
    status | awk -v wanted="$1" '/^Workload / { number += 1 } number == wanted && /^node-/ { print $1 }' | sort
}

# Both scenes are watched, scene $1 first; a node that serves it alone is killed after 8 s and started again after 15 s.
# The viewer of the other scene notices less of it.
kill_while_served() {
    local scene="$1" other="$2" own_viewer other_viewer victim
    watch_scene "$scene" 5 "out/cluster/killed" &
    own_viewer=$!
    sleep 3
    watch_scene "$other" 2 "out/cluster/beside" &
    other_viewer=$!
    sleep 5
    status
    victim="$(comm -23 <(nodes_of 1) <(nodes_of 2) | tail -n 1)"
    : "${victim:?no node serves $scene alone}"
    compose kill -s KILL "$victim"
    sleep 2
    status
    sleep 5
    compose up --detach --no-recreate "$victim"
    wait "$own_viewer"
    wait "$other_viewer"
    wait_until_healthy "$victim"
}

# The link of the viewer, as this machine reaches it.
viewer_link() {
    local token
    token="$(compose logs --no-color gateway | grep -o 'token=[0-9a-f]*' | tail -n 1)"
    echo "http://127.0.0.1:7421/?${token:?the gateway has printed no link}"
}

# A browser opens the link, drags and rests.
visit() {
    scripts/ensure-browser.sh
    MYRIORAMA_VIEWER="$(viewer_link)" "${CARGO:-cargo}" test --quiet --release --locked --package browser-tests \
        --test suite running_cluster:: -- --ignored --nocapture
}

build
if [ "${1:-}" = --test ]; then
    export MYRIORAMA_SAMPLING=non_redundant:coverage
    trap 'compose down --timeout 15 --volumes' EXIT
fi
compose up --detach
wait_until_healthy "${services[@]}"
views
status
if [ "${1:-}" = --test ]; then
    sampled_by_several
    kill_while_served "${scenes[0]}" "${scenes[1]}"
    kill_while_served "${scenes[1]}" "${scenes[0]}"
    views
    # The last, as a gateway's visitors have a workload of their own for a while.
    visit
else
    echo "The viewer: $(viewer_link)"
    echo "The cluster runs: myriorama view --coordinator $coordinator …; docker-compose --project-name myriorama --file deploy/compose.yaml down ends it."
fi
