"""kmax-board, its bxCAN on the guest's CAN interface and its pins on the GPIO chip's lines; and kmax holding an axis of
it."""

import json
import os
import re
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from can_capture import INTERFACE
from gpio_sim import CHIP
from kmax_under_test import KMAX, VirtualBoard, kmax, kmax_json

ROOT = Path(__file__).resolve().parents[3]
SCENE = ROOT / "host_tools" / "simulation" / "scenes" / "motor_axes.toml"

POWER_STAGE_READY = 6000  # ticks, of which 20,000 are a second


class BoardOnBus(VirtualBoard):
    """Also offers its serial line (`device`); kmax reaches it over CAN as `can_device`. Nobody touches its handles,
    unless `person`: then the scene's presses them against the walls when it has started."""

    can_device = f"can:{INTERFACE}"

    def __init__(self, *options, person=False):
        self._scene_folder = tempfile.TemporaryDirectory()
        scene = SCENE
        if not person:
            scene = Path(self._scene_folder.name) / "free_handles.toml"
            scene.write_text(re.sub(r"\[(axis1\.)?(operator|motion)\]\n(\w[^\n]*\n|\n)*", "", SCENE.read_text()))
        super().__init__("--can", INTERFACE, "--gpio", CHIP, "--scene", str(scene), *options)
        self.wait_until_it_answers()

    def __exit__(self, *exception):
        super().__exit__(*exception)
        self._scene_folder.cleanup()

    def wait_until_it_answers(self):
        end = time.monotonic() + 20
        while True:
            done = kmax("get", "info.tick", "--json", device=self.can_device, check=False)
            # The power stage takes a tenth of a second of the board's own time to start.
            if done.returncode == 0 and json.loads(done.stdout)["info.tick"]["value"] > POWER_STAGE_READY:
                return
            if time.monotonic() > end or (done.returncode != 0 and "no answer" not in done.stderr):
                self.process.kill()
                raise AssertionError(f"the board does not answer: {done.stderr}{self.process.communicate()[0]}")

    def finish(self):
        """Ends it; returns what it said."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.communicate(timeout=20)[0]

    def kmax(self, *arguments, **options):
        return kmax(*arguments, device=self.can_device, **options)

    def json(self, *arguments, **options):
        return kmax_json(*arguments, device=self.can_device, **options)

    def axis(self, axis=0):
        return self.json("state", "--axis", str(axis))["axes"][0]


class Holding:
    """`kmax arm --hold` on the bus, from when the axis is armed to the end of the block, where it is killed if it still
    runs."""

    def __init__(self, axis=0):
        self.process = subprocess.Popen([KMAX, "--device", BoardOnBus.can_device, "arm", "--hold", "--axis", str(axis)],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def __enter__(self):
        first = self.process.stdout.readline()
        if "Operation enabled" not in first:
            raise AssertionError(f"it was not armed: {first}{self.process.communicate(timeout=20)[0]}")
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate(timeout=20)

    def ended(self):
        """What it said after arming, and its exit code, once it has ended by itself."""
        said = self.process.communicate(timeout=20)[0]
        return said, self.process.returncode

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)
        return self.ended()


def give_lines(test):
    """Until the test class or test ends, kmax finds the board's lines. The emergency stop's contact is open when its
    line is low, as with a relay that drops out."""
    folder = tempfile.TemporaryDirectory()
    file = Path(folder.name) / "lines.toml"
    names = {"reset": "NRST", "emergency_stop": "ESTOP", "fault": "FAULT", "healthy": "HEALTHY"}
    file.write_text("".join(f'[lines.{role}]\nchip = "{CHIP}"\nname = "{name}"\n'
                            + ('active = "low"\n' if role == "emergency_stop" else "")
                            for role, name in names.items()))
    os.environ["KMAX_LINES"] = str(file)
    test.addClassCleanup(os.environ.pop, "KMAX_LINES")
    test.addClassCleanup(folder.cleanup)
