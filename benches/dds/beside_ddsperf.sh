#!/bin/sh
# A sample between two network namespaces, ours beside CycloneDDS's own ddsperf (whose latency is half its round trip), by turns. As root; needs iproute2 and ddsperf (Debian: cyclonedds-tools).
#   cargo build --release --workspace --example ros2_peer && benches/dds/beside_ddsperf.sh [ROUNDS]
set -eu
rounds=${1:-3}
seconds=10
here=$(cd "$(dirname "$0")/../.." && pwd)
peer=${CARGO_TARGET_DIR:-$here/target}/release/examples/ros2_peer
command -v ddsperf >/dev/null || { echo "ddsperf is not installed: apt install cyclonedds-tools" >&2; exit 3; }
[ -x "$peer" ] || { echo "$peer: is missing; the second line of this script makes it" >&2; exit 3; }
a=bdp$$a b=bdp$$b out=$(mktemp -d)
echoes=
tidy() { [ -z "$echoes" ] || kill $echoes 2>/dev/null || true; ip netns del $a 2>/dev/null || true; ip netns del $b 2>/dev/null || true; rm -rf "$out"; }
trap tidy EXIT INT TERM
ip netns add $a; ip netns add $b
ip -n $a link add veth0 type veth peer name veth0 netns $b
for n in "$a 10.9.1.1" "$b 10.9.1.2"; do
    set -- $n
    ip -n "$1" addr add "$2/24" dev veth0; ip -n "$1" link set veth0 up; ip -n "$1" link set lo up; ip -n "$1" route add 224.0.0.0/4 dev veth0
done
export ROS_DOMAIN_ID=9

# Median and 99th percentile of ddsperf: of the lines that it prints each second, the median line.
ddsperf_round() { # name, mode of both ends, word for the 1 kHz
    ip netns exec $b ddsperf -u -i 10 pong "$2" >/dev/null 2>&1 & echoes=$!
    sleep 1
    ip netns exec $a ddsperf -u -i 10 -D $seconds ping 1000Hz size 232 "$2" >"$out/raw" 2>&1 || true
    kill $echoes 2>/dev/null || true; wait $echoes 2>/dev/null || true; echoes=
    sed -n 's|.* size [0-9]* mean .* 50% \([0-9.]*\)us .* 99% \([0-9.]*\)us max.*|\1 \2|p' "$out/raw" >"$out/seconds"
    p50=$(cut -d' ' -f1 "$out/seconds" | sort -n | awk '{v[NR]=$1} END {print v[int((NR+1)/2)]}')
    p99=$(cut -d' ' -f2 "$out/seconds" | sort -n | awk '{v[NR]=$1} END {print v[int((NR+1)/2)]}')
    echo "$1;$p50;$p99" >>"$out/all"
}
ours_round() {
    ip netns exec $b "$peer" echo >/dev/null 2>&1 & echoes=$!
    sleep 1
    ip netns exec $a "$peer" ping $((seconds * 1000)) 1000 >"$out/raw"
    kill $echoes 2>/dev/null || true; wait $echoes 2>/dev/null || true; echoes=
    sed -n 's/.*"one_way_us": \[\([0-9.]*\), \([0-9.]*\)\].*"round_trip_us": \[\([0-9.]*\), \([0-9.]*\)\].*/\1 \2 \3 \4/p' "$out/raw" | while read -r o50 o99 r50 r99; do
        echo "ours, one way;$o50;$o99"; echo "ours, round trip;$r50;$r99"
    done >>"$out/all"
}
i=0
while [ $i -lt "$rounds" ]; do
    ours_round
    ddsperf_round "ddsperf, one way, listener" listener
    ddsperf_round "ddsperf, one way, waitset" waitset
    i=$((i + 1))
done
echo "us, medians of $rounds rounds of $seconds s by turns, 1 kHz, best effort"
for name in "ours, one way" "ours, round trip" "ddsperf, one way, listener" "ddsperf, one way, waitset"; do
    for column in 2 3; do
        grep "^$name;" "$out/all" | cut -d';' -f$column | sort -n | awk '{v[NR]=$1} END {print v[int((NR+1)/2)]}'
    done | paste -s -d' ' | while read -r p50 p99; do printf '%-32s p50 %7s  p99 %7s\n' "$name" "$p50" "$p99"; done
done
