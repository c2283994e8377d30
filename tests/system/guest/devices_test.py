"""The guest itself: CAN frames between programs that share nothing else, and the lines of the GPIO chip seen from both
sides. What fails here fails because of the guest, not because of Kmax."""

import re
import select
import socket
import struct
import subprocess
import sys
import time
import unittest

from can_capture import INTERFACE, CanCapture, Frame, parse, send
from gpio_sim import CHIP, SimulatedLine, held, line_numbers
from kmax_under_test import PATIENCE


class CanBus(unittest.TestCase):
    def test_what_cansend_sends_candump_hears(self):
        with CanCapture() as capture:
            before = time.time()
            send("601#40181001")
            frame = capture.wait_for(lambda frame: frame.id == 0x601)
            self.assertEqual(frame.data, bytes.fromhex("40181001"))
            self.assertFalse(frame.extended or frame.remote)
            self.assertTrue(before - 1 < frame.time < time.time() + 1)

    def test_every_kind_of_frame(self):
        with CanCapture() as capture:
            for text in ("000#", "7FF#0011223344556677", "1FFFFFFF#FF", "123#R", "080##0" + "5A" * 64):
                send(text)
            frames = capture.wait_for(lambda frame: True, count=5)
        self.assertEqual([frame[1:] for frame in frames], [
            (0x000, b"", False, False), (0x7FF, bytes.fromhex("0011223344556677"), False, False),
            (0x1FFFFFFF, b"\xFF", True, False), (0x123, b"", False, True), (0x080, b"\x5A" * 64, False, False)])

    def test_none_is_lost_and_the_order_stays(self):
        with CanCapture() as capture:
            subprocess.run(["cangen", INTERFACE, "-g", "0", "-p", "10", "-n", "500", "-I", "42", "-L", "4", "-D", "i"],
                           check=True, timeout=PATIENCE)
            frames = capture.wait_for(lambda frame: frame.id == 0x42, count=500)
        self.assertEqual([int.from_bytes(frame.data, "little") for frame in frames], list(range(500)))
        self.assertEqual(sorted(frame.time for frame in frames), [frame.time for frame in frames])

    def test_a_filter_keeps_the_others_out(self):
        with CanCapture("700:780") as capture:
            send("181#01")
            send("701#05")
            capture.wait_for(lambda frame: frame.id == 0x701)
            self.assertEqual([frame.id for frame in capture.frames()], [0x701])

    def test_a_program_of_its_own_on_a_raw_socket(self):
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus, CanCapture() as capture:
            bus.bind((INTERFACE,))
            bus.settimeout(PATIENCE)
            bus.send(struct.pack("=IB3x8s", 0x185, 2, b"\x12\x34"))
            self.assertEqual(capture.wait_for(lambda frame: frame.id == 0x185).data, b"\x12\x34")
            send("205#99")
            identifier, length, data = struct.unpack("=IB3x8s", bus.recv(16))
            self.assertEqual((identifier, data[:length]), (0x205, b"\x99"))

    def test_segmented_messages_of_the_kernel(self):
        with subprocess.Popen(["isotprecv", "-s", "321", "-d", "123", INTERFACE], stdout=subprocess.PIPE,
                              text=True) as receiver:
            self.addCleanup(receiver.kill)
            message = bytes(range(100)).hex(" ").upper()
            # It says nothing when it is ready: whoever has sent too early sends again.
            for _ in range(50):
                subprocess.run(["isotpsend", "-s", "123", "-d", "321", INTERFACE], input=message, text=True,
                               capture_output=True, timeout=PATIENCE)
                if select.select([receiver.stdout], [], [], 0.1)[0]:
                    break
            self.assertEqual(receiver.stdout.readline().split(), message.split())

    def test_a_frame_that_nobody_sent_is_missed(self):
        with CanCapture() as capture, self.assertRaisesRegex(AssertionError, "0 of 1 frames"):
            capture.wait_for(lambda frame: True, seconds=0.1)

    def test_a_line_of_candump_that_is_none(self):
        self.assertEqual(parse("(1700000000.250000) vcan0 185#0102"), Frame(1700000000.25, 0x185, b"\x01\x02"))
        with self.assertRaises(ValueError):
            parse("interface vcan0 went down")


class Gpio(unittest.TestCase):
    def setUp(self):
        self.lines = {name: SimulatedLine(name) for name in line_numbers()}
        for line in self.lines.values():
            line.drive(0)

    def get(self, name):
        return int(subprocess.run(["gpioget", CHIP, str(self.lines[name].number)], check=True, capture_output=True,
                                  text=True, timeout=PATIENCE).stdout)

    def test_the_lines_have_the_names_of_the_board(self):
        self.assertEqual(set(self.lines), {"NRST", "BOOT0", "ESTOP", "FAULT", "HEALTHY", "SWDIO", "SWCLK"})

    def test_an_input_has_the_level_that_is_driven(self):
        for level in (1, 0, 1):
            self.lines["FAULT"].drive(level)
            self.assertEqual(self.get("FAULT"), level)
            self.assertEqual(self.get("HEALTHY"), 0)

    def test_an_output_is_seen_outside_and_falls_back_when_it_is_released(self):
        reset, boot = self.lines["NRST"], self.lines["BOOT0"]
        with held(NRST=1, BOOT0=1):
            reset.wait_for(1)
            boot.wait_for(1)
            self.assertEqual(reset.users(), "gpioset")
        self.assertIsNone(reset.users())
        reset.wait_for(0)

    def test_a_line_has_one_user(self):
        line = self.lines["ESTOP"]
        with held(ESTOP=1):
            line.wait_for(1)
            second = subprocess.run(["gpioset", CHIP, f"{line.number}=0"], capture_output=True, text=True,
                                    timeout=PATIENCE, check=False)
            self.assertNotEqual(second.returncode, 0)
            self.assertIn("busy", second.stderr)
            self.assertEqual(line.level(), 1)

    def test_edges_come_as_events_with_their_time(self):
        line = self.lines["FAULT"]
        with subprocess.Popen(["gpiomon", "-b", "-F", "%e %s.%n", "-n", "4", CHIP, str(line.number)],
                              stdout=subprocess.PIPE, text=True) as monitor:
            self.addCleanup(monitor.kill)
            end = time.monotonic() + PATIENCE
            while line.users() is None and time.monotonic() < end:
                time.sleep(0.01)
            events = []
            for level in (1, 0, 1, 1, 0):  # the repeated one is no edge
                edge = not events or level != int(events[-1][0])
                line.drive(level)
                # Two edges of which nobody was told in between may come as one.
                if edge:
                    events.append(monitor.stdout.readline().split())
                time.sleep(0.01)
            self.assertEqual(monitor.wait(PATIENCE), 0)
        self.assertEqual([kind for kind, _ in events], ["1", "0", "1", "0"])
        times = [float(re.sub(r"\.(\d+)$", lambda part: f".{int(part[1]):09}", stamp)) for _, stamp in events]
        self.assertEqual(times, sorted(times))
        self.assertGreater(times[1] - times[0], 0)


if __name__ == "__main__":
    sys.exit(unittest.main())
