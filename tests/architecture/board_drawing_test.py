"""The document of a board's connectors is what the firmware is built with."""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "odrive_v3"
DRAWING = ROOT / "scripts" / "board_drawing"


def firmware_pins():
    source = (ROOT / "board" / "odrive_v3" / "pins.hpp").read_text()
    pins = re.findall(r"inline constexpr PinLocation (\w+)\{GpioPort::(\w), (\d+)\};", source)
    return {name: f"P{port.upper()}{number}" for name, port, number in pins}


class BoardDrawing(unittest.TestCase):
    def setUp(self):
        self.data = tomllib.loads((FOLDER / "connectors.toml").read_text())
        self.connected = [pin for group in self.data["connector"] for pin in group["pins"]]

    def test_every_pin_of_the_firmware_is_on_a_connector_or_inside(self):
        pins = firmware_pins()
        self.assertGreater(len(pins), 20)
        documented = {pin["name"]: pin["chip"] for pin in self.connected if "name" in pin}
        inside = self.data["inside"]["names"]
        self.assertEqual(documented, {name: pin for name, pin in pins.items() if name not in inside})
        self.assertLessEqual(set(inside), set(pins))

    def test_no_chip_pin_twice(self):
        chips = [pin["chip"] for pin in self.connected if "chip" in pin]
        self.assertEqual(len(chips), len(set(chips)))

    def test_page_and_drawing_are_made_of_the_data(self):
        subprocess.run([DRAWING, "--check"], check=True)

    def test_the_check_sees_what_is_stale(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("connectors.toml", "connectors.md", "connectors.svg"):
                shutil.copy(FOLDER / name, folder)
            data = Path(folder) / "connectors.toml"
            data.write_text(data.read_text().replace('chip = "PC4"', 'chip = "PC5"'))
            result = subprocess.run([DRAWING, "--check", folder], capture_output=True, text=True)
            self.assertEqual(result.returncode, 1)
            self.assertIn("connectors.md", result.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main())
