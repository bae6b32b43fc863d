#!/usr/bin/env bash
# Whether this commit makes the same pictures, frames and depth images as another, to the byte, and as fast.
#
#   scripts/same_as.sh COMMIT           a matrix of 4 scenes x sampling x reconstruction x lighting, and policies
#   scripts/same_as.sh COMMIT --times   the ratios of g_s, g_v, c and d, on a machine that does nothing else
#
# Both commits are built; both serve each scene in turn; one client of this commit asks both and hashes what they send.
# A renderer chooses rays or triangles by timing. A row that differs is therefore asked again of new processes, up to
# six times: it is equal once both commits have given one same answer. Exit status 1: a row differs.
set -euo pipefail
cd "$(dirname "$0")/.."

commit="${1:?usage: scripts/same_as.sh COMMIT [--times]}"
mode="${2:-}"
scenes=(courtyard tree-terrain-30k-wind blocks bird-nest)
out="target/same_as"
old_tree="$out/tree"
mkdir -p "$out"
[ -n "${XDG_RUNTIME_DIR:-}" ] || export NODEVICE_SELECT=1

servers=()
stop() {
    for server in "${servers[@]}"; do kill "$server" 2>/dev/null || true; done
    for server in "${servers[@]}"; do wait "$server" 2>/dev/null || true; done
    servers=()
}
trap stop EXIT

build() {
    rm -rf "$old_tree"
    mkdir -p "$old_tree"
    git archive "$commit" | tar -x -C "$old_tree"
    (cd "$old_tree" && cargo build --release --locked --package myriorama --target-dir ../build)
    cargo build --release --locked --package myriorama --package cluster-tests --bin myriorama --bin compare_clusters
    old="$out/build/release/myriorama"
    new="target/release/myriorama"
    compare="target/release/compare_clusters"
}

# serve PROGRAM SCENE LOG: starts a cluster; `url` is its coordinator's.
serve() {
    "$1" up --scene "$2" --nodes 3 --listen 127.0.0.1:0 --sample-size 160x120 >"$3" 2>&1 &
    servers+=("$!")
    for _ in $(seq 600); do
        url="$(sed -n 's|.* at \(http://[0-9.:]*\)$|\1|p' "$3")"
        [ -z "$url" ] || return 0
        sleep 0.1
    done
    echo "$1 does not serve $2: see $3" >&2
    return 1
}

# ask PROGRAM SCENE NAME [TEXT]: the answers of a new process, into NAME.txt.
ask() {
    serve "$1" "$2" "$out/$3.log"
    "$compare" bytes "$url" "${4:-}" >"$out/$3.txt"
    stop
}

# A line of an answer is "row | hashes".
differing_rows() {
    diff --changed-group-format='%<' --unchanged-group-format='' "$1" "$2" | sed 's/ | [^|]*$//' || true
}

# Whether new processes of both commits ever give one same answer to a row.
settles() {
    local scene="$1" row="$2"
    : >"$out/old_answers.txt"
    : >"$out/new_answers.txt"
    for _ in 1 2 3 4 5 6; do
        ask "$old" "$scene" retry_old "$row"
        ask "$new" "$scene" retry_new "$row"
        cat "$out/retry_old.txt" >>"$out/old_answers.txt"
        cat "$out/retry_new.txt" >>"$out/new_answers.txt"
        if grep -qxFf "$out/old_answers.txt" "$out/new_answers.txt"; then return 0; fi
    done
    return 1
}

bytes() {
    local equal=0 different=0 scene row
    for scene in "${scenes[@]}"; do
        ask "$old" "$scene" "old-$scene"
        ask "$new" "$scene" "new-$scene"
        if ! cmp -s <(sed 's/ | [^|]*$//' "$out/old-$scene.txt") <(sed 's/ | [^|]*$//' "$out/new-$scene.txt"); then
            echo "$scene: the commits were not asked the same rows" >&2
            return 1
        fi
        differing_rows "$out/old-$scene.txt" "$out/new-$scene.txt" >"$out/differing.txt"
        while IFS= read -r answer; do
            row="${answer% | *}"
            if ! grep -qxF "$row" "$out/differing.txt" || settles "$scene" "$row"; then
                echo "equal    $scene | $row"
                equal=$((equal + 1))
            else
                echo "differs  $scene | $row"
                different=$((different + 1))
            fi
        done <"$out/new-$scene.txt"
    done
    echo "$equal equal, $different different"
    [ "$different" -eq 0 ] && [ "$equal" -gt 0 ]
}

times() {
    local urls=() program
    for program in "$old" "$new" "$old"; do
        serve "$program" tree-terrain-30k "$out/times-${#urls[@]}.log"
        urls+=("$url")
    done
    echo "old ${urls[0]}, new ${urls[1]}, old once more ${urls[2]}; $(uptime)"
    "$compare" times "${urls[@]}"
}

build
if [ "$mode" = --times ]; then times; else bytes; fi
