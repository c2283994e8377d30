#!/usr/bin/python3
"""How long `kmax get wall.stiffness` takes, from its start to its end, against a device that `kmax serve` serves.

usage: tests/benchmarks/get_time.py [KMAX]        KMAX: default build/native/kmax

Prints a table in Markdown of 100 calls, in ms. The last column leaves out the time in which the program could run but
others had the processor (/proc/PID/schedstat). What the device waited for a processor is still in it, so an idle machine
takes no longer. Exit code 3: its median is above 20 ms.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CALLS, LIMIT_MS = 100, 20.0


def call(kmax, device):
    begin = time.monotonic()
    process = subprocess.Popen([kmax, "--device", device, "get", "wall.stiffness"], stdout=subprocess.DEVNULL)
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # it has ended and can still be asked
    taken = (time.monotonic() - begin) * 1e3
    waited = int(Path(f"/proc/{process.pid}/schedstat").read_text().split()[1]) * 1e-6
    if process.wait() != 0:
        sys.exit(f"get_time: {device} did not answer")
    return taken, taken - waited


def main(arguments):
    kmax = arguments[0] if arguments else "build/native/kmax"
    processor = next((line.split(": ")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    print(f"{os.cpu_count()} x {processor}\n")
    print("| `kmax get` over | fastest, ms | median | median without its waits for a processor | limit | |\n|---|---:|---:|---:|---:|---|")
    kept = True
    with tempfile.TemporaryDirectory() as folder:
        for link, option in (("serial", "--serial"), ("can", "--can")):
            place = f"{folder}/{link}"
            with subprocess.Popen([kmax, "serve", option, place], stdout=subprocess.DEVNULL) as server:
                while not os.path.exists(place):
                    time.sleep(0.05)
                time.sleep(0.5)
                taken, alone = zip(*(call(kmax, f"{link}:{place}") for _ in range(CALLS)))
                server.terminate()
            good = statistics.median(alone) <= LIMIT_MS
            kept = kept and good
            print(f"| {link} | {min(taken):.1f} | {statistics.median(taken):.1f} | {statistics.median(alone):.1f} | "
                  f"{LIMIT_MS:.0f} | {'kept' if good else '**broken**'} |")
    return 0 if kept else 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
