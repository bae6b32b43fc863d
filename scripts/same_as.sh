#!/usr/bin/env bash
# Compares this commit with another: equal pictures, frames and depth images, to the byte, and equal speed.
#
#   scripts/same_as.sh COMMIT           a matrix of 4 scenes x sampling x reconstruction x lighting, and policies
#   scripts/same_as.sh COMMIT --times   the ratios of g_s, g_v, c and d, on an otherwise idle machine; both commits must
#                                       have the same protocol, since one client measures them in turn
#
# Builds both commits. Each serves each scene in turn and is asked by its own client, since the protocol may differ.
# Rows are compared by name. Rows that only one commit has are listed and are not counted. Refusals are equal, whatever
# their words.
# A renderer chooses rays or triangles by timing. New processes therefore repeat rows that differ, up to five times: a
# row is equal once both commits have given one same answer. Exit status 1: a row differs.
set -euo pipefail
cd "$(dirname "$0")/.."

commit="${1:?usage: scripts/same_as.sh COMMIT [--times]}"
mode="${2:-}"
scenes=(courtyard tree-terrain-30k-wind mirror-hall urban)
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
    local programs=(--package myriorama --package cluster-tests --bin myriorama --bin compare_clusters)
    (cd "$old_tree" && cargo build --release --locked "${programs[@]}" --target-dir ../build)
    cargo build --release --locked "${programs[@]}"
    old="$out/build/release"
    new="target/release"
}

# serve PROGRAMS SCENE LOG: starts a cluster; `url` is its coordinator's.
serve() {
    "$1/myriorama" up --scene "$2" --nodes 3 --listen 127.0.0.1:0 --sample-size 160x120 >"$3" 2>&1 &
    servers+=("$!")
    for _ in $(seq 600); do
        url="$(sed -n 's|.* at \(http://[0-9.:]*\)$|\1|p' "$3")"
        [ -z "$url" ] || return 0
        sleep 0.1
    done
    echo "$1/myriorama does not serve $2: see $3" >&2
    return 1
}

# ask PROGRAMS SCENE NAME [ROWS]: the answers of a new process to all rows, or to those of a file, are added to NAME.txt.
ask() {
    serve "$1" "$2" "$out/$3.log"
    "$1/compare_clusters" bytes "$url" ${4:+"$4"} | sed 's/ | refused: .*/ | refused/' >>"$out/$3.txt"
    stop
}

# The rows of answers: a line of an answer is "row | hashes".
rows_of() {
    sed 's/ | [^|]*$//' "$@"
}

# Rows of both commits to which they have not yet given one same answer, into differing.txt.
compare() {
    comm -12 <(sort -u "$out/old-$1.txt") <(sort -u "$out/new-$1.txt") >"$out/same.txt"
    grep -vxFf <(rows_of "$out/same.txt") "$out/rows.txt" >"$out/differing.txt" || true
}

# Rows of both commits, into rows.txt; those of one commit are printed.
pair() {
    rows_of "$out/old-$1.txt" | sort -u >"$out/old-rows.txt"
    rows_of "$out/new-$1.txt" | sort -u >"$out/new-rows.txt"
    comm -12 "$out/old-rows.txt" "$out/new-rows.txt" >"$out/rows.txt"
    comm -23 "$out/old-rows.txt" "$out/new-rows.txt" | sed "s/^/only old $1 | /"
    comm -13 "$out/old-rows.txt" "$out/new-rows.txt" | sed "s/^/only new $1 | /"
}

bytes() {
    local equal=0 different=0 scene row
    for scene in "${scenes[@]}"; do
        rm -f "$out/old-$scene.txt" "$out/new-$scene.txt"
        ask "$old" "$scene" "old-$scene"
        ask "$new" "$scene" "new-$scene"
        pair "$scene"
        compare "$scene"
        for _ in 1 2 3 4 5; do
            [ -s "$out/differing.txt" ] || break
            cp "$out/differing.txt" "$out/again.txt"
            ask "$old" "$scene" "old-$scene" "$out/again.txt"
            ask "$new" "$scene" "new-$scene" "$out/again.txt"
            compare "$scene"
        done
        while IFS= read -r row; do
            if grep -qxF "$row" "$out/differing.txt"; then
                echo "differs  $scene | $row"
                different=$((different + 1))
            else
                echo "equal    $scene | $row"
                equal=$((equal + 1))
            fi
        done <"$out/rows.txt"
    done
    echo "$equal equal, $different different"
    [ "$different" -eq 0 ] && [ "$equal" -gt 0 ]
}

times() {
    local urls=() programs
    for programs in "$old" "$new" "$old"; do
        serve "$programs" tree-terrain-30k "$out/times-${#urls[@]}.log"
        urls+=("$url")
    done
    echo "old ${urls[0]}, new ${urls[1]}, old once more ${urls[2]}; $(uptime)"
    "$new/compare_clusters" times "${urls[@]}"
}

build
if [ "$mode" = --times ]; then times; else bytes; fi
