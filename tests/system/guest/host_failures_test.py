"""What remains of the force when the host fails: interrupted, killed, or cut off from the bus."""

import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from board_on_bus import BoardOnBus, Holding
from can_capture import INTERFACE, CanCapture, send
from gpio_sim import SimulatedLine
from kmax_under_test import KMAX, PATIENCE, kmax

TICK_RATE = 20000
INTERRUPTIONS = 20


def ip_link(state):
    subprocess.run(["ip", "link", "set", INTERFACE, state], check=True, timeout=PATIENCE)


class Interrupted(unittest.TestCase):
    def test_ctrl_c_at_any_moment_leaves_the_drive_disarmed(self):
        seed = time.time_ns() % 10 ** 6  # the guest has no entropy to give soon
        print(f"seed of the interruptions: {seed}", flush=True)
        moments = random.Random(seed)
        with tempfile.TemporaryDirectory() as folder, BoardOnBus() as board:
            commands = (["arm", "--hold"], ["capture", "--arm", "--trigger", "contact", "--out", f"{folder}/capture.csv"],
                        ["record", f"{folder}/record.csv"], ["arm", "--hold", "--axis", "1"])
            # Nothing but the program itself takes the force away: link.timeout is long. The moments reach beyond the
            # one at which this machine, as busy as it is, has armed the axis.
            begin = time.monotonic()
            with Holding():
                latest = 2 * (time.monotonic() - begin)
            board.kmax("disarm")
            for number in range(INTERRUPTIONS):
                command = commands[number % len(commands)]
                delay = moments.uniform(0, latest)
                with self.subTest(command=command, delay=delay, seed=seed):
                    with subprocess.Popen([KMAX, "--device", board.can_device, *command], stdout=subprocess.PIPE,
                                          stderr=subprocess.STDOUT, text=True) as process:
                        time.sleep(delay)
                        process.send_signal(signal.SIGINT)
                        said = process.communicate(timeout=PATIENCE)[0]
                    # Before it has got ready for Ctrl-C it has done nothing either.
                    self.assertIn(process.returncode, (0, 1, -signal.SIGINT), said)
                    for axis in board.json("state")["axes"]:
                        self.assertEqual((axis["armed"], axis["state"]), (False, "switch_on_disabled"), said)
            # A recording puts the node back: there are no more PDOs.
            with CanCapture() as capture:
                board.json("state")
                capture.wait_for(lambda frame: frame.id == 0x581)
                self.assertEqual({frame.id for frame in capture.frames()} - {0x601, 0x581}, set())
            with Holding() as holding:
                said, code = holding.interrupt()
            self.assertEqual(code, 0, said)
            self.assertIn("disarmed", said)


class Killed(unittest.TestCase):
    def test_a_killed_host_s_force_is_gone_within_link_timeout(self):
        timeout_s = 1.0
        with BoardOnBus(person=True) as board, CanCapture() as capture:
            board.kmax("set", f"link.timeout={timeout_s}")
            force, tick = self.telemetry(capture)
            with Holding() as holding:
                # The person presses against the wall: there is force to be taken away.
                capture.wait_for(lambda frame: force(frame) is not None and force(frame) > 100)
                holding.process.kill()
                holding.process.wait()
                capture.wait_for(lambda frame: frame.id == 0x081 and frame.data[0] != 0)
                time.sleep(0.5)
            frames = capture.frames()
            send("000#8001")
            fault = board.axis()["fault"]
            self.assertEqual(fault["name"], "link_silent")
            self.assertAlmostEqual(fault["bound"], timeout_s, places=5)
            self.assertLess(fault["value"], timeout_s + 0.001)
            # Its own order tells when the board heard the host last: the request may have waited for a busy board.
            last_word = max(at for at, frame in enumerate(frames) if frame.id == 0x581)
            ticks = [tick(frame) for frame in frames[last_word:] if tick(frame) is not None]
            emergency = next(at for at, frame in enumerate(frames) if frame.id == 0x081)
            # Ticks from that reply to the first PDO without force, a PDO's period more at both ends.
            passed, last_force, gone_after = 0, None, None
            previous = ticks[0]
            for frame in frames[last_word:]:
                if tick(frame) is not None:
                    passed += (tick(frame) - previous) % 65536
                    previous = tick(frame)
                if force(frame) is not None:
                    last_force = force(frame)
                    if last_force == 0 and gone_after is None:
                        gone_after = passed
            self.assertIsNotNone(gone_after, "the force stayed")
            self.assertLessEqual(gone_after, timeout_s * TICK_RATE + 3 * 20)
            self.assertEqual(last_force, 0)
            self.assertGreater(emergency, last_word)
            board.kmax("clear")
            self.assertFalse(board.axis()["armed"])

    def telemetry(self, capture):
        """Starts the PDOs. Of a frame: axis 0's force (mN), the device's tick; None if it is not in it."""
        send("000#0101")
        capture.wait_for(lambda frame: frame.id == 0x481)

        def force(frame):
            return abs(round(1000 * as_float(frame.data[4:8]))) if frame.id == 0x181 else None

        def tick(frame):
            return int.from_bytes(frame.data[6:8], "little") if frame.id == 0x481 else None

        return force, tick


def as_float(data):
    return struct.unpack("<f", data)[0]


class CutOff(unittest.TestCase):
    def fails(self, device, *parts, command=("state",)):
        done = kmax(*command, device=device, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stdout, "")
        for part in parts:
            self.assertIn(part, done.stderr)

    def test_an_interface_that_goes_down_takes_the_force_away(self):
        self.addCleanup(ip_link, "up")
        with BoardOnBus() as board:
            board.kmax("set", "link.timeout=1")
            healthy = SimulatedLine("HEALTHY")
            healthy.wait_for(1)
            with Holding() as holding:
                ip_link("down")
                said, code = holding.ended()
            self.assertEqual(code, 1, said)
            self.assertIn(f"the interface is down; bring it up: 'sudo ip link set {INTERFACE} up'", said)
            self.assertIn("link.timeout removes its force after 1 s", said)
            self.fails(board.can_device, "the interface is down", f"sudo ip link set {INTERFACE} up")
            healthy.wait_for(0)
            ip_link("up")
            board.wait_until_it_answers()
            state = board.axis()
            self.assertEqual((state["armed"], state["fault"]["name"]), (False, "link_silent"))

    def test_a_recording_says_what_it_has_when_the_interface_goes_down(self):
        self.addCleanup(ip_link, "up")
        with tempfile.TemporaryDirectory() as folder, BoardOnBus() as board:
            file = Path(folder) / "rows.csv"
            with subprocess.Popen([KMAX, "--device", board.can_device, "record", str(file)], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True) as process:
                end = time.monotonic() + PATIENCE
                while (not file.exists() or file.stat().st_size < 1000) and time.monotonic() < end:
                    time.sleep(0.05)
                ip_link("down")
                said = process.communicate(timeout=PATIENCE)[1]
            self.assertEqual(process.returncode, 1, said)
            self.assertIn("the interface is down", said)
            self.assertIn(str(file), said)
            self.assertGreater(len(file.read_text().splitlines()), 5)

    def test_no_interface_and_no_node(self):
        self.fails("can:vcan7", "vcan7: there is no such interface", f"CAN interfaces here are {INTERFACE}",
                   "ip link add dev vcan7 type vcan")
        for command in (("state",), ("arm", "--hold"), ("record", "/tmp/rows.csv"), ("get", "wall.stiffness")):
            with self.subTest(command=command):
                self.fails(f"can:{INTERFACE}?node=9", "no answer from node 9", "check", command=command)


if __name__ == "__main__":
    sys.exit(unittest.main())
