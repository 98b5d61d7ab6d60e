#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A cable with a delay between two network namespaces: slow_cable.py NAMESPACE NAMESPACE DEVICE SECONDS

A TUN device of that name in each; what enters one leaves the other after that time, in order. For kernels without
tc's netem. Needs root. Says "ready", and goes on until it is killed."""
import collections
import ctypes
import fcntl
import os
import select
import struct
import sys
import time

TUNSETIFF, TUN_WITHOUT_HEADER, CLONE_NEWNET = 0x400454CA, 0x1001, 0x40000000


def device_in(namespace, name):
    here = os.open("/proc/self/ns/net", os.O_RDONLY)
    libc = ctypes.CDLL(None, use_errno=True)
    for place in (f"/run/netns/{namespace}", None):
        handle = os.open(place, os.O_RDONLY) if place else here
        if libc.setns(handle, CLONE_NEWNET) != 0:
            sys.exit(f"slow_cable.py: {place or 'the first namespace'}: {os.strerror(ctypes.get_errno())}")
        if place:
            tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
            fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH22x", name.encode(), TUN_WITHOUT_HEADER))
    return tun


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    delay = float(sys.argv[4])
    ends = [device_in(namespace, sys.argv[3]) for namespace in sys.argv[1:3]]
    under_way = collections.deque()  # (when it is due, where, the packet)
    print("ready", flush=True)
    while True:
        wait = max(0.0, under_way[0][0] - time.monotonic()) if under_way else None
        for end in select.select(ends, [], [], wait)[0]:
            for _ in range(64):
                try:
                    packet = os.read(end, 70000)
                except BlockingIOError:
                    break
                under_way.append((time.monotonic() + delay, ends[1 - ends.index(end)], packet))
        while under_way and under_way[0][0] <= time.monotonic():
            _, end, packet = under_way.popleft()
            try:
                os.write(end, packet)
            except OSError:  # a side is down: the packet is lost
                pass


if __name__ == "__main__":
    main()
