"""A spring and a damper at the handle, made by this program: spring.py [ADDRESS]"""

import sys

import kmax


class Spring:
    def __init__(self, stiffness, damping):
        self.stiffness, self.damping, self.rest = stiffness, damping, None

    def __call__(self, sample):
        if self.rest is None:
            self.rest = sample.position
        return -self.stiffness * (sample.position - self.rest) - self.damping * sample.velocity


with kmax.Device(sys.argv[1] if len(sys.argv) > 1 else None) as device:
    record = device.force_loop(Spring(stiffness=200, damping=0.5), seconds=2)
print(f"{len(record.time)} cycles at {record.rate:.0f} Hz, {record.missed} missed, up to {abs(record.force).max():.2f} N")
