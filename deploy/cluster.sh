#!/usr/bin/env bash
# Starts the cluster of deploy/compose.yaml, waits until all services are healthy, and requests 24 views, which must
# agree with direct rendering. With --test it also kills nodes while a client is served, and then stops the cluster.
#
# The program is expected at target/release/myriorama, or at $MYRIORAMA.
set -euo pipefail
cd "$(dirname "$0")/.."

program="${MYRIORAMA:-target/release/myriorama}"
coordinator=http://127.0.0.1:7420
services=(coordinator node-1 node-2 node-3 node-4)

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
    "$program" view --coordinator "$coordinator" --views 24 --policy pipeline --compare --least-psnr 24 \
        --out out/cluster
}

# A client moves for 20 s; a node is killed after 5 s and started again after 12 s.
kill_while_served() {
    local victim="$1" live
    "$program" view --coordinator "$coordinator" --orbit 120 --policy pipeline --live --rate 10 --seconds 20 \
        --longest-gap 5 --out "out/cluster/$victim" &
    live=$!
    sleep 5
    compose kill -s KILL "$victim"
    sleep 7
    compose up --detach --no-recreate "$victim"
    wait "$live"
    wait_until_healthy "$victim"
}

build
if [ "${1:-}" = --test ]; then
    trap 'compose down --timeout 15' EXIT
fi
compose up --detach
wait_until_healthy "${services[@]}"
views
"$program" status --coordinator "$coordinator"
if [ "${1:-}" = --test ]; then
    kill_while_served node-4
    kill_while_served node-1
    views
else
    echo "The cluster runs: myriorama view --coordinator $coordinator …; docker-compose --project-name myriorama --file deploy/compose.yaml down ends it."
fi
