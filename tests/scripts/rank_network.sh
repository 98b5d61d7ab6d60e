#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Two ranks that are apart: a network namespace each, with an address, a rate and a delay of its own.
#   rank_network.sh BUILD
# The scene has the bits of one rank, the wire carries what the run says that it sent, and a network that drops
# ends both ranks. Needs root, ip and tc; skips without them. Prints the time of a step at each rate and delay.
set -uo pipefail
build=$(cd "${1:?the build folder}" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)
darb=$build/darb
for needed in mpirun ip tc; do
    command -v "$needed" >/dev/null || { echo "skipped: no $needed"; exit 77; }
done
[[ $(id -u) == 0 ]] || { echo "skipped: network namespaces need root"; exit 77; }
"$darb" --version | grep -q '^with ' || { echo "skipped: $darb is built without MPI"; exit 77; }
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

# Two machines, side_0 and side_1, and a cable between them.
tag=darb$$
sides=("$tag.0" "$tag.1")
addresses=(10.77.77.1 10.77.77.2)
cable=darb_cable
helper=
clean() {
    for side in "${sides[@]}"; do
        ip netns pids "$side" 2>/dev/null | xargs -r kill -KILL 2>/dev/null
        ip netns delete "$side" 2>/dev/null
    done
    [[ -z $helper ]] || kill "$helper" 2>/dev/null
    rm -rf "$folder"
}
trap clean EXIT
made=$({ ip netns add "${sides[0]}" && ip netns add "${sides[1]}"; } 2>&1) ||
    { echo "skipped: no network namespaces here: $made"; exit 77; }
# link RATE: a cable of that rate. link delay SECONDS: one that takes that time.
link() {
    [[ -z $helper ]] || kill "$helper"
    helper=
    ip -n "${sides[0]}" link delete "$cable" 2>/dev/null
    if [[ $1 == delay ]]; then
        coproc "$root/tests/scripts/slow_cable.py" "${sides[@]}" "$cable" "$2"
        helper=$COPROC_PID
        read -r -t 10 <&"${COPROC[0]}" || { echo "skipped: no TUN devices here"; exit 77; }
    else
        ip link add "$cable" netns "${sides[0]}" type veth peer name "$cable" netns "${sides[1]}"
    fi
    for i in 0 1; do
        ip -n "${sides[i]}" address add "${addresses[i]}/24" dev "$cable"
        ip -n "${sides[i]}" link set "$cable" up
        ip -n "${sides[i]}" link set lo up
        [[ $1 == delay ]] && continue
        ip netns exec "${sides[i]}" tc qdisc replace dev "$cable" root tbf rate "$1" burst 4mb latency 100ms ||
            { echo "skipped: tc cannot hold a rate here"; exit 77; }
    done
}
wire_bytes() { ip netns exec "${sides[0]}" cat "/sys/class/net/$cable/statistics/tx_bytes"; }

# In the place of ssh: mpirun gives an address and what to start there.
cat >"$folder/agent" <<TEXT
#!/usr/bin/env bash
host=\$1
shift
[[ \$host == ${addresses[1]} ]] || { echo "no machine \$host" >&2; exit 1; }
exec ip netns exec ${sides[1]} unshare --uts bash -c "hostname other; \$*"
TEXT
chmod +x "$folder/agent"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_btl_base_warn_component_unused=0
data=$root/assets/scene
options=(train "$data" -r 50 --batch 4 --no-report --densify-until-iter 0)
# apart FOLDER OPTIONS...: a rank on each side.
apart() {
    local out=$1
    shift
    ip netns exec "${sides[0]}" mpirun --mca plm_rsh_agent "$folder/agent" --mca btl tcp,self \
        --mca btl_tcp_if_include 10.77.77.0/24 --mca oob_tcp_if_include 10.77.77.0/24 --map-by node \
        -H "${addresses[0]},${addresses[1]}" -n 2 "$darb" "${options[@]}" -o "$out" "$@" >"$out.log" 2>&1
}

LP_NUM_THREADS=1 "$darb" "${options[@]}" -o "$folder/one" --iterations 160 -q >"$folder/one.log" 2>&1
scene=point_cloud/iteration_160/point_cloud.ply
for way in 10gbit 1gbit 'delay 0.001'; do
    # shellcheck disable=SC2086 # two words
    link $way
    before=$(wire_bytes)
    LP_NUM_THREADS=1 apart "$folder/two" --iterations 160
    carried=$(($(wire_bytes) - before))
    line=$(grep -oE '2 ranks: [0-9.]+ MB a step from each, [0-9.]+ ms a step' "$folder/two.log")
    check "$way: both took part" '^2 ranks' "$line"
    check "$way: the bits of one rank" "^$(sha256sum <"$folder/one/$scene")\$" "$(sha256sum <"$folder/two/$scene" 2>&1)"
    [[ -n $line ]] || { cat "$folder/two.log"; exit 1; }
    said=$(awk '{printf "%d", $3 * 40 * 1e6}' <<<"$line") # 160 views in batches of 4
    check "$way: the cable carries what the run says, within 10 %" '^(9[0-9]|10[0-9]|110)$' "$((100 * carried / said))"
    echo "        $line of sending and waiting; $((carried / 40)) bytes a step on the cable"
    rm -rf "$folder/two"
done

# The network drops in the middle: both say so and end, and the last checkpoint goes on.
out=$folder/dropped
apart "$out" --iterations 1000000 --checkpoint-interval 40 &
pid=$!
for _ in {1..300}; do [[ -s $out/checkpoint.darb ]] && break; sleep 0.1; done
check 'a checkpoint before the network drops' 'checkpoint.darb' "$(ls "$out")"
ip -n "${sides[1]}" link set "$cable" down
start=$SECONDS
wait "$pid" && { echo "FAILED  the network drops: exit code 0"; failed=1; }
check 'the network drops: the command ends within 30 s' '^([0-9]|[12][0-9]|30)$' "$((SECONDS - start))"
check 'the network drops: names the rank' 'error: rank 1 of 2 on other has said nothing' "$(cat "$out.log")"
for _ in {1..300}; do [[ -z $(pgrep -f "darb train $data .* -o $out ") ]] && break; sleep 0.1; done
check 'the network drops: nobody is left within 30 s more' '^$' "$(pgrep -af "darb train $data .* -o $out ")"
check 'the network drops: goes on' 'resumed .* at iteration' \
    "$(timeout 20 "$darb" "${options[@]}" -o "$out" --iterations 1000000 --resume 2>&1)"
exit "$failed"
