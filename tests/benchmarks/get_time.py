#!/usr/bin/python3
"""How long `kmax get wall.stiffness` takes, from its start to its end, against a device that `kmax serve` serves.

usage: tests/benchmarks/get_time.py [KMAX]        KMAX: default build/native/kmax

Prints a table in Markdown of 100 calls, in ms. Where that is permitted (to root), program and device run at real-time
priority, so that what else the machine does hardly counts: as on an idle one. Exit code 3: a median is above 20 ms.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time

CALLS, LIMIT_MS = 100, 20.0


def call(kmax, device):
    begin = time.monotonic()
    done = subprocess.run([kmax, "--device", device, "get", "wall.stiffness"], stdout=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        sys.exit(f"get_time: {device} did not answer")
    return (time.monotonic() - begin) * 1e3


def wait_for(server, place):
    end = time.monotonic() + 10
    while not os.path.exists(place):
        if server.poll() is not None or time.monotonic() > end:
            sys.exit(f"get_time: kmax serve does not offer {place}")
        time.sleep(0.05)


def main(arguments):
    kmax = arguments[0] if arguments else "build/native/kmax"
    processor = next((line.split(": ")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
        priority = "real-time priority"
    except PermissionError:
        priority = "usual priority"
    print(f"{os.cpu_count()} x {processor}, {priority}:\n")
    print("| `kmax get` over | fastest, ms | median | worst | limit of the median | |\n|---|---:|---:|---:|---:|---|")
    kept = True
    with tempfile.TemporaryDirectory() as folder:
        for link, option in (("serial", "--serial"), ("can", "--can")):
            place = f"{folder}/{link}"
            with subprocess.Popen([kmax, "serve", option, place], stdout=subprocess.DEVNULL) as server:
                try:
                    wait_for(server, place)
                    taken = [call(kmax, f"{link}:{place}") for _ in range(CALLS)]
                finally:
                    server.terminate()
            good = statistics.median(taken) <= LIMIT_MS
            kept = kept and good
            print(f"| {link} | {min(taken):.1f} | {statistics.median(taken):.1f} | {max(taken):.1f} | "
                  f"{LIMIT_MS:.0f} | {'kept' if good else '**broken**'} |")
    return 0 if kept else 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
