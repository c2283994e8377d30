"""How regularly does a force loop go? force_loop_timing.py ADDRESS [--seconds 60] [--rate HZ]

For the least jitter: chrt --fifo 50 /usr/bin/python3 force_loop_timing.py ...
"""

import argparse

import kmax
import numpy as np


def histogram(what, seconds, edges_us):
    """Lines of a table: how many of the times lie between two of the edges, in us."""
    counts, _ = np.histogram(np.asarray(seconds) * 1e6, [*edges_us, np.inf])
    print(f"| {what} | cycles | share |\n|---:|---:|---:|")
    for count, low, high in zip(counts, edges_us, [*edges_us[1:], None]):
        label = f"{low} us and more" if high is None else f"{low} to {high} us"
        print(f"| {label} | {count} | {count / max(1, len(seconds)):.2%} |")
    print()


parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("address")
parser.add_argument("--seconds", type=float, default=60)
parser.add_argument("--rate", type=float)
options = parser.parse_args()

with kmax.Device(options.address) as device:
    record = device.force_loop(lambda sample: -0.5 * sample.velocity, seconds=options.seconds, rate=options.rate)

cycles = len(record.time) + record.missed
print(f"{cycles} cycles at {record.rate:.1f} Hz over {options.address.split(':')[0]}, {record.missed} missed "
      f"({record.missed / cycles:.3%})")
for what, times in [("round trip", record.round_trip), ("lateness", record.lateness)]:
    p50, p99, p100 = np.percentile(times * 1e6, [50, 99, 100])
    print(f"{what}: median {p50:.0f} us, 99 % within {p99:.0f} us, longest {p100:.0f} us")
print()
period = 1e6 / record.rate
histogram("round trip", record.round_trip, [round(period * part) for part in (0, 0.25, 0.5, 0.75, 1, 2)])
histogram("lateness", record.lateness, [0, 50, 100, 200, 500, 1000])
