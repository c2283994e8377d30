"""The image on a USB cable: Linux' own drivers, cdc_acm and gs_usb, find it, and kmax speaks to it through both."""

import fcntl
import os
import socket
import struct
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from board_on_bus import SCENE
from can_capture import INTERFACE
from kmax_under_test import ELF, PATIENCE, Holding, Serve, VirtualBoard, kmax, kmax_json, wait_for
from node_canopen_test import CLIENT, Bridge, run_script

ROOT = Path(__file__).resolve().parents[3]
CONTROLLER = Path("/sys/devices/platform/vhci_hcd.0")
TERMINAL = Path("/dev/ttyACM0")
PORT = 3240
SEGMENTS_KEPT_FOR_A_LATE_PC = 16  # 32 of docs/usb.md, for two masters


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


def ask_for_boot_loader():
    """The vendor request, as any program may send it: usbdevice_fs.h, USBDEVFS_CONTROL."""
    device = next(path.parent for path in Path("/sys/bus/usb/devices").glob("*/idVendor") if path.read_text().strip() == "1209")
    bus, number = (int((device / name).read_text()) for name in ("busnum", "devnum"))
    request = struct.pack("@BBHHHI4xP", 0x40, 0xDF, 0x4446, 0, 0, 1000, 0)
    with open(f"/dev/bus/usb/{bus:03}/{number:03}", "r+b", buffering=0) as node:
        fcntl.ioctl(node, 3 << 30 | len(request) << 16 | ord("U") << 8, request)


@unittest.skipUnless(CONTROLLER.exists(), "this kernel has no virtual USB host controller")
class Cable(unittest.TestCase):
    """A board whose USB connector is this kernel's."""

    options = ()

    @classmethod
    def setUpClass(cls):
        cls.board = cls.enterClassContext(VirtualBoard("--usbip", str(PORT), *cls.options))
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


class OnACable(Cable):
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

    def listed(self):
        """What kmax devices says of each address that it has."""
        return {one["address"]: one["description"] for one in kmax_json("devices")["devices"]}

    @property
    def address(self):
        number = kmax_json("get", "info.serial_number", device=self.board.device)["info.serial_number"]["value"]
        return f"usb:{number:08X}"

    def test_kmax_finds_it_by_its_serial_number(self):
        first, second = interfaces()
        devices = self.listed()
        self.assertIn(f"serial port {TERMINAL}; CAN {first}, {second}", devices[self.address])
        self.assertIn(f"of {self.address}", devices[f"serial:{TERMINAL}"])
        self.assertIn(f"CAN interface of {self.address}, the board alone, down: sudo ip link set {first} up",
                      devices[f"can:{first}"])
        self.assertIn("with the bus at its connector, down", devices[f"can:{second}"])
        # As a user does what it says.
        command = devices[f"can:{first}"].split(": sudo ")[1]
        subprocess.run(command.split(), check=True)
        self.addCleanup(subprocess.run, ["ip", "link", "set", first, "down"], check=False)
        self.assertIn("the board alone, up", self.listed()[f"can:{first}"])
        found = kmax_json("devices", "--can", first)["devices"]
        self.assertTrue(any(one["address"] == f"can:{first}" and one["description"].startswith("Kmax ") for one in found), found)

    def test_kmax_speaks_to_it_by_its_serial_number(self):
        for device in "usb", self.address, self.address.lower():
            kmax("set", "wall.stiffness=3456", device=device)
            self.assertEqual(kmax_json("get", "wall.stiffness", device=self.board.device)["wall.stiffness"]["value"], 3456)
            kmax("set", "wall.stiffness=1000", device=device)
        self.assertIn(f"there is {self.address}", kmax("info", device="usb:00000000", check=False).stderr)

    def test_without_its_driver_kmax_says_which_is_missing(self):
        driver = Path("/sys/bus/usb/drivers/cdc_acm")
        interface = next(path.name for path in driver.iterdir() if path.name.endswith(":1.1"))
        (driver / "unbind").write_text(interface)
        self.addCleanup(wait_for, TERMINAL)
        self.addCleanup((driver / "bind").write_text, interface)
        wait_until(lambda: not TERMINAL.exists(), "the port stays")
        self.assertIn("no serial port: plug it in again, or 'sudo modprobe cdc_acm'", self.listed()[self.address])
        done = kmax("info", device="usb", check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("sudo modprobe cdc_acm", done.stderr)

    def flash_with_a_dfu_util_that_finds_nothing(self):
        """The way to it is what is tried: no ROM is there that would answer dfu-util."""
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "dfu-util"
            program.write_text("#!/bin/sh\nexit 74\n")
            program.chmod(0o755)
            path = os.environ["PATH"]
            os.environ["PATH"] = f"{folder}:{path}"
            try:
                return kmax("flash", ELF, "--method", "dfu", "--device", "usb", check=False)
            finally:
                os.environ["PATH"] = path

    def test_flashing_is_refused_while_armed_by_the_program_and_by_the_firmware(self):
        with Holding("usb") as holding:
            done = self.flash_with_a_dfu_util_that_finds_nothing()
            self.assertEqual(done.returncode, 1)
            self.assertIn("axis 0 is armed", done.stderr)
            # Without the program's question the firmware answers the request itself.
            with self.assertRaises(BrokenPipeError):
                ask_for_boot_loader()
            self.assertEqual(kmax_json("state", device=self.board.device)["axes"][0]["state"], "operation_enabled")
            holding.interrupt()

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

    def test_zz_disarmed_it_restarts_for_the_boot_loader(self):
        # The last one: what the image jumps to then is in no model.
        address = self.address
        done = self.flash_with_a_dfu_util_that_finds_nothing()
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(f"start the ROM bootloader: {address} restarts", done.stderr)
        self.assertIn("has restarted, but no board in DFU mode (0483:df11) appeared at its USB port", done.stderr)
        wait_until(lambda: not TERMINAL.exists(), "it has not left the bus")


class BehindTheBoard(Cable):
    """The board, whose node has another number, is the adapter to a bus on which there is a second one, node 1."""

    @classmethod
    def setUpClass(cls):
        scene = Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "scene.toml"
        scene.write_text(SCENE.read_text().replace("[parameters]\n", "[parameters]\nnode.id = 5\n"))
        cls.options = ("--can", INTERFACE, "--scene", str(scene))
        cls.neighbour = cls.enterClassContext(Serve("--can", INTERFACE))
        super().setUpClass()
        cls.addClassCleanup(cls.pull_out)

    def setUp(self):
        self.channel = interfaces()[1]
        # A block of 127 segments is handed over at once, and Linux' own queue has ten places.
        subprocess.run(["ip", "link", "set", self.channel, "txqueuelen", "1000"], check=True)
        self.bring_up(self.channel)

    def test_kmax_reaches_both_nodes(self):
        neighbour, own = f"can:{self.channel}?node=1", f"can:{self.channel}?node=5"
        kmax("set", "wall.stiffness=1500", device=neighbour)
        kmax("set", "wall.stiffness=2500", device=own)
        for device, expected in (self.neighbour.device, 1500), (self.board.device, 2500):
            self.assertEqual(kmax_json("get", "wall.stiffness", device=device)["wall.stiffness"]["value"], expected)

    @unittest.skipUnless(CLIENT.exists(), f"left out: {CLIENT} is not installed (scripts/install_node_packages)")
    def test_a_master_not_written_here_commands_the_neighbour_through_it(self):
        with Bridge(self.channel) as bridge:
            printed = run_script(self, "master.mjs", bridge.stream, SEGMENTS_KEPT_FOR_A_LATE_PC)
        self.assertIn(" 0 FAILED", printed)
        self.assertIn(" 0 left out", printed)
        self.assertEqual(kmax_json("get", "counters.missed_ticks",
                                   device=self.board.device)["counters.missed_ticks"]["value"], 0)


if __name__ == "__main__":
    unittest.main()
