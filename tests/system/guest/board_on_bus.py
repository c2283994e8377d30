"""kmax-board, its bxCAN on the guest's CAN interface and its pins on the GPIO chip's lines; and kmax holding an axis of
it."""

import os
import re
import signal
import tempfile
from pathlib import Path

import kmax_under_test
from can_capture import INTERFACE
from gpio_sim import CHIP
from kmax_under_test import PATIENCE, VirtualBoard, kmax, kmax_json

ROOT = Path(__file__).resolve().parents[3]
SCENE = ROOT / "host_tools" / "simulation" / "scenes" / "motor_axes.toml"


class BoardOnBus(VirtualBoard):
    """Also offers its serial line (`device`); kmax reaches it over CAN as `can_device`. Nobody touches its handles,
    unless `person`: then the scene's presses them against the walls when it has started. Its link.timeout is such that
    a kmax which a busy machine holds up does not count as silent."""

    can_device = f"can:{INTERFACE}"

    def __init__(self, *options, person=False):
        self._scene_folder = tempfile.TemporaryDirectory()
        text = SCENE.read_text().replace("[parameters]\n", f"[parameters]\nlink.timeout = {PATIENCE}\n")
        if not person:
            text = re.sub(r"\[(axis1\.)?(operator|motion)\]\n(\w[^\n]*\n|\n)*", "", text)
        scene = Path(self._scene_folder.name) / "scene.toml"
        scene.write_text(text)
        super().__init__("--can", INTERFACE, "--gpio", CHIP, "--scene", str(scene), *options)

    def __exit__(self, *exception):
        super().__exit__(*exception)
        self._scene_folder.cleanup()

    def wait_until_it_answers(self, device=None):
        super().wait_until_it_answers(device or self.can_device)

    def finish(self):
        """Ends it; returns what it said."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.communicate(timeout=PATIENCE)[0]

    def kmax(self, *arguments, **options):
        return kmax(*arguments, device=self.can_device, **options)

    def json(self, *arguments, **options):
        return kmax_json(*arguments, device=self.can_device, **options)

    def axis(self, axis=0):
        return self.json("state", "--axis", str(axis))["axes"][0]


class Holding(kmax_under_test.Holding):
    """`kmax arm --hold` on the bus."""

    def __init__(self, axis=0):
        super().__init__(BoardOnBus.can_device, axis)


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
