"""The image on a USB cable: Linux' own drivers, cdc_acm and gs_usb, find it, and kmax speaks to it through both."""

import os
import socket
import struct
import subprocess
import time
import unittest
from pathlib import Path

from kmax_under_test import PATIENCE, Holding, VirtualBoard, kmax, kmax_json, wait_for

ROOT = Path(__file__).resolve().parents[3]
CONTROLLER = Path("/sys/devices/platform/vhci_hcd.0")
TERMINAL = Path("/dev/ttyACM0")
PORT = 3240


def wait_until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"{what}; the kernel said:\n{subprocess.run(['dmesg'], capture_output=True, text=True).stdout[-3000:]}")
        time.sleep(0.05)


def interfaces():
    """The CAN interfaces that gs_usb made, in the order of their channels."""
    made = [path for path in Path("/sys/class/net").iterdir() if (path / "device" / "driver").exists()
            and (path / "device" / "driver").resolve().name == "gs_usb"]
    return [path.name for path in sorted(made, key=lambda path: int((path / "dev_id").read_text(), 16))]


@unittest.skipUnless(CONTROLLER.exists(), "this kernel has no virtual USB host controller")
class OnACable(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.board = cls.enterClassContext(VirtualBoard("--usbip", str(PORT)))
        cls.plug_in()

    @classmethod
    def plug_in(cls):
        done = subprocess.run([str(ROOT / "scripts/linux_guest.d/attach_usb"), "--wait", str(PATIENCE), str(PORT)],
                              capture_output=True, text=True, timeout=2 * PATIENCE, check=False)
        if done.returncode != 0:
            raise AssertionError(done.stderr)
        cls.port = done.stdout.strip()
        wait_for(TERMINAL)
        wait_until(lambda: len(interfaces()) == 2, "gs_usb made no two interfaces")

    @classmethod
    def pull_out(cls):
        (CONTROLLER / "detach").write_text(cls.port)
        wait_until(lambda: not TERMINAL.exists() and not interfaces(), "the devices stay")

    @classmethod
    def enterClassContext(cls, context):  # as unittest has from Python 3.11 on
        entered = context.__enter__()
        cls.addClassCleanup(context.__exit__, None, None, None)
        return entered

    def bring_up(self, interface):
        subprocess.run(["ip", "link", "set", interface, "up", "type", "can", "bitrate", "1000000"], check=True)
        self.addCleanup(subprocess.run, ["ip", "link", "set", interface, "down"], check=False)

    def test_the_serial_port_does_what_the_serial_line_does(self):
        device = f"serial:{TERMINAL}"
        self.assertEqual(kmax_json("get", "info.serial_number", device=device),
                         kmax_json("get", "info.serial_number", device=self.board.device))
        kmax("set", "wall.stiffness=1234", device=device)
        self.assertEqual(kmax_json("get", "wall.stiffness", device=self.board.device)["wall.stiffness"]["value"], 1234)
        self.assertIn("allowed", kmax("set", "wall.stiffness=-1", device=device, check=False).stderr)
        # Everything that the device has, through reads of many registers.
        self.assertGreater(len(kmax("list", device=device).stdout.splitlines()), 50)

    def test_the_node_answers_over_can_without_a_bus(self):
        first = interfaces()[0]
        self.bring_up(first)
        device = f"can:{first}"
        kmax("set", "wall.stiffness=2345", device=device)
        self.assertEqual(kmax_json("get", "wall.stiffness", device=device)["wall.stiffness"]["value"], 2345)

    def test_frames_come_back_as_sent_and_none_is_lost(self):
        first = interfaces()[0]
        self.bring_up(first)
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
            bus.bind((first,))
            bus.settimeout(PATIENCE)
            answers = 0
            for number in range(300):
                bus.send(struct.pack("=IB3x8s", 0x601, 8, bytes.fromhex("4000100000000000")))
                while True:
                    identifier, length, data = struct.unpack("=IB3x8s", bus.recv(16))
                    if identifier == 0x581:
                        break
                answers += 1
                self.assertEqual(data[:4], bytes.fromhex("43001000"), number)
            self.assertEqual(answers, 300)

    def test_pulled_out_while_armed_the_force_is_gone_and_it_comes_back(self):
        device = f"serial:{TERMINAL}"
        kmax("set", "link.timeout=0.5", device=device)
        with Holding(device) as holding:
            self.assertEqual(kmax_json("state", device=self.board.device)["axes"][0]["state"], "operation_enabled")
            self.pull_out()
            wait_until(lambda: kmax_json("state", device=self.board.device)["axes"][0]["state"] != "operation_enabled",
                       "it is still armed")
            self.assertNotEqual(holding.ended()[1], 0)
        self.plug_in()
        self.assertGreater(kmax_json("get", "info.tick", device=device)["info.tick"]["value"], 0)
        self.assertEqual(kmax_json("get", "counters.missed_ticks", device=device)["counters.missed_ticks"]["value"], 0)
        self.assertEqual(kmax_json("get", "info.crash_count", device=device)["info.crash_count"]["value"], 0)


if __name__ == "__main__":
    unittest.main()
