"""The board's lines as wires: emergency stop, reset, fault and healthy, by kmax and by the tools of libgpiod."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import json_schemas
from board_on_bus import BoardOnBus, Holding, give_lines
from can_capture import CanCapture
from gpio_sim import CHIP, SimulatedLine, held
from kmax_under_test import KMAX, PATIENCE, kmax, kmax_json

EMERGENCY_STOP = bytes.fromhex("02FF")  # 0xFF02, low byte first
TICK_US = 50


def is_emergency(frame, axis):
    return frame.id == 0x81 and frame.data[:2] == EMERGENCY_STOP and frame.data[3] == axis


class Lines(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        give_lines(cls)

    def setUp(self):
        self.board = BoardOnBus()
        self.addCleanup(self.board.__exit__)

    def watch(self, *lines):
        """kmax lines watch, which has begun to."""
        process = subprocess.Popen([KMAX, "lines", "watch", *(part for line in lines for part in ("--line", line))],
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        return process, [process.stdout.readline() for _ in lines]

    def reset(self):
        """kmax reset, again if the board's process was held up for the whole pulse."""
        for _ in range(20):
            kmax("reset")
            self.board.wait_until_it_answers()
            if self.board.json("info")["info"]["reset_cause"] == "pin":
                return
        self.fail("none of 20 resets was noticed")

    def test_emergency_stop_takes_both_bridges_off_within_a_tick(self):
        SimulatedLine("HEALTHY").wait_for(1)
        with CanCapture() as capture, Holding(0) as first, Holding(1) as second:
            watch, now = self.watch("healthy")
            self.assertRegex(now[0], r"^ *now +healthy +healthy$")
            with subprocess.Popen([KMAX, "lines", "set", "emergency_stop=stop"], stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True) as stop:
                self.addCleanup(stop.kill)
                for axis, holding in enumerate((first, second)):
                    said, code = holding.ended()
                    self.assertEqual(code, 1)
                    self.assertIn("emergency stop", said)
                    capture.wait_for(lambda frame, axis=axis: is_emergency(frame, axis))
                stop.send_signal(signal.SIGINT)
                self.assertEqual(stop.wait(PATIENCE), 0, "Ctrl-C is its end")
            # The kernel's time of the edge, s.
            self.assertRegex(watch.stdout.readline(), r"^ *\d+\.\d{9} +healthy +not ready$")
        for axis in (0, 1):
            state = self.board.axis(axis)
            self.assertEqual((state["armed"], state["fault"]["name"]), (False, "emergency_stop"))
        answers = re.findall(r"ESTOP low, both bridges off (\d+) us later", self.board.finish())
        self.assertEqual(len(answers), 1)
        self.assertLessEqual(int(answers[0]), TICK_US)

    def test_gpioset_opens_the_contact_as_well_and_closing_it_does_not_arm(self):
        with CanCapture() as capture, Holding() as holding:
            with held(ESTOP=0):
                capture.wait_for(lambda frame: is_emergency(frame, 0))
                self.assertEqual(holding.ended()[1], 1)
                refused = self.board.kmax("clear", check=False)
                self.assertIn("emergency stop", refused.stdout + refused.stderr)
                self.assertEqual(self.board.axis()["fault"]["name"], "emergency_stop")
                refused = self.board.kmax("arm", check=False)
                self.assertEqual(refused.returncode, 1)
        state = self.board.axis()
        self.assertEqual((state["armed"], state["fault"]["name"]), (False, "emergency_stop"))
        self.board.kmax("clear")
        self.assertEqual(self.board.axis()["state"], "switch_on_disabled")
        SimulatedLine("HEALTHY").wait_for(1)
        with Holding() as again:
            self.assertEqual(again.interrupt()[1], 0)
        self.assertRegex(self.board.finish(), r"ESTOP low, both bridges off ([0-4]?\d|50) us later")

    def test_reset_starts_it_again_with_what_was_saved(self):
        before = self.board.json("info")
        self.board.kmax("set", "wall.damping=1.25", "axis1.wall.stiffness=750")
        self.board.kmax("save")
        self.board.kmax("set", "wall.damping=2")
        with CanCapture("701:7FF") as capture:
            self.reset()
            self.assertEqual(capture.wait_for(lambda frame: True).data, b"\x00")
            self.assertEqual(len(capture.frames()), 1)
        after = self.board.json("info")
        self.assertEqual(after["identity"], before["identity"])
        self.assertEqual(after["info"]["serial_number"], before["info"]["serial_number"])
        self.assertEqual(after["info"]["reset_cause"], "pin")
        self.assertEqual(after["info"]["crash_count"], 0)
        values = self.board.json("get", "wall.damping", "axis1.wall.stiffness")
        self.assertEqual([entry["value"] for entry in values.values()], [1.25, 750])

    def test_reset_of_an_armed_board_leaves_it_disarmed(self):
        with CanCapture() as capture, Holding():
            self.reset()
            capture.wait_for(lambda frame: frame.id == 0x701 and frame.data == b"\x00")
            self.assertFalse(self.board.axis()["armed"])

    def test_lines_shows_what_the_board_drives(self):
        SimulatedLine("HEALTHY").wait_for(1)
        shown = kmax("lines").stdout
        self.assertRegex(shown, r"healthy .*input: high, healthy")
        self.assertRegex(shown, r"fault .*input: high, none")
        self.assertRegex(shown, r"emergency_stop .*put: high, run")

    def test_documents_with_json_are_as_their_schemas_say(self):
        SimulatedLine("HEALTHY").wait_for(1)
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(Path(os.environ["KMAX_LINES"]).read_text() + f'[lines.boot0]\nchip = "{CHIP}"\nname = "BOOT0"\n')
            file.flush()
            for command, *arguments in (("lines",), ("lines watch", "--line", "healthy", "--for", "0.2"),
                                        ("lines set", "emergency_stop=run", "--for", "0.2"), ("reset",), ("bootloader",)):
                document = kmax_json(*command.split(), *arguments, "--lines", file.name)
                json_schemas.check(self, document, command.replace(" ", "-"))
            self.assertIn("boot0", kmax_json("lines", "--lines", file.name))


if __name__ == "__main__":
    sys.exit(unittest.main())
