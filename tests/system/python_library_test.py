"""The Python module kmax against `kmax serve`, over a CAN bus at a Unix socket and a serial line: what it sets and reads, and
that nothing that happens to a program leaves its force on."""

import contextlib
import ctypes
import os
import re
import signal
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

import kmax
import numpy as np

from kmax_under_test import PATIENCE, Serve, kmax as command_line, wait_for

TICKS_PER_SECOND = 20000


class Served(Serve):
    """A device on both links."""

    def __init__(self):
        super().__init__("--can", "BUS")
        wait_for(self.link.parent / "bus")

    @property
    def bus(self):
        return f"can:{self.link.parent / 'bus'}"


def program(text, *arguments):
    """Another Python program, which says "ready" when it has come so far."""
    process = subprocess.Popen([sys.executable, "-c", "import os, sys, time, kmax\n" + text, *arguments],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    first = process.stdout.readline()
    if first.strip() != "ready":
        process.kill()
        raise AssertionError(f"it said '{first}' instead of 'ready':\n{process.communicate()[1]}")
    return process


LOOP = """
device = kmax.Device(sys.argv[1])
cycles = 0
def pull(sample):
    global cycles
    cycles += 1
    if cycles == 50:
        print("ready", flush=True)
    return 0.3
device.force_loop(pull, watchdog=5)
"""
WALL = """
device = kmax.Device(sys.argv[1])
with device.armed():
    print("ready", flush=True)
    time.sleep(1000)
"""
UNTIL_DISARMED = """
import sys, kmax
with kmax.Device(sys.argv[1]) as device:
    while device.status().armed:
        continue
"""


class AgainstAServedDevice(unittest.TestCase):
    def setUp(self):
        self.served = self.enterContext(Served())

    def open(self, address=None):
        return self.enterContext(kmax.Device(address or self.served.bus))

    def assertDisarmed(self, device):
        self.assertEqual(device.status().state, "switch_on_disabled")


class ReadsAndSets(AgainstAServedDevice):
    def test_ten_lines(self):
        os.environ["KMAX_DEVICE"] = self.served.bus
        self.addCleanup(os.environ.pop, "KMAX_DEVICE")
        with kmax.Device() as device:
            device["wall.stiffness"] = "0.5 N/mm"
            device["wall.position"] = "here - 5 mm"
            with device.armed():
                recording = device.record(0.5)
        self.assertEqual(len(recording.time), 500 - recording.lost)
        self.assertAlmostEqual(recording.time[-1], 0.4995, delta=0.002)
        self.assertLess(np.ptp(recording.position), 1)

    def test_the_program_of_the_readme(self):
        readme = (Path(__file__).resolve().parents[2] / "README.md").read_text()
        text = re.search(r"```python\n(.*?)```", readme, re.DOTALL)[1]
        self.assertIn("can:/tmp/bus", text)
        done = subprocess.run([sys.executable, "-c", text.replace("can:/tmp/bus", self.served.bus)], capture_output=True,
                              text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 0, done.stderr)
        deepest, hardest = map(float, re.search(r"deepest (\S+) mm, hardest (\S+) N", done.stdout).groups())
        self.assertGreater(deepest, 0, "the hand is in the wall")
        self.assertGreater(hardest, 0)
        self.assertRegex(done.stdout, r"\d+ cycles missed")

    def test_units_and_types(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address) as device:
                device.set({"wall.stiffness": np.float32(0.1), "wall.damping": np.int64(2), "wall.law": "adaptive"})
                self.assertEqual(device.get("wall.stiffness", "wall.damping", "wall.law", "info.tick_rate"),
                                 {"wall.stiffness": 0.1, "wall.damping": 2.0, "wall.law": "adaptive", "info.tick_rate": 20000})
                self.assertIs(type(device["info.tick_rate"]), int)
                self.assertEqual(device.unit("wall.stiffness"), "N/m")
                for wrong in "5 mm", "much", float("nan"), -1, True, None, [1]:
                    with self.assertRaises(ValueError, msg=wrong) as caught:
                        device["wall.stiffness"] = wrong
                    self.assertIn("wall.stiffness", str(caught.exception))
                with self.assertRaisesRegex(ValueError, "wall.stiffness"):
                    device["wall.stifness"]
                with self.assertRaisesRegex(TypeError, "no mapping from names to values, such as"):
                    device.set("wall.stiffness=5N/mm")
                self.assertEqual(device["wall.stiffness"], 0.1)

    def test_errors_are_of_this_module(self):
        with self.assertRaisesRegex(kmax.LinkError, "no bus at this path") as caught:
            kmax.Device("can:/nowhere/bus")
        self.assertIsInstance(caught.exception, kmax.Error)
        self.assertEqual(type(caught.exception).__module__, "kmax")
        with self.assertRaisesRegex(ValueError, "allowed are sim"):
            kmax.Device("tcp:0")
        device = kmax.Device(self.served.bus)
        device.close()
        with self.assertRaisesRegex(kmax.Error, "closed"):
            device["wall.law"]
        self.assertFalse(device.is_open)

    def test_two_programs_at_once(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address):
                with kmax.Device(address) as other:
                    self.assertEqual(other["wall.law"], "plain")

    def test_an_idle_device_leaves_the_link_to_others(self):
        for address in self.served.bus, self.served.device:
            for armed in False, True:
                with self.subTest(address, armed=armed), kmax.Device(address) as device, contextlib.ExitStack() as stack:
                    if armed:
                        device["wall.position"] = "-100 mm"  # the hand has pressed already
                        stack.enter_context(device.armed())
                    # A command gives up after 2 s without the link.
                    command_line("--device", address, "get", "wall.law")
                    self.assertEqual(device["wall.law"], "plain")

    def test_a_capture(self):
        device = self.open()
        capture = device.capture(["position", "force"], samples=200, pre_trigger=50, trigger="force", level=0.05,
                                 when_ready=lambda: device.arm())
        device.disarm()
        self.assertEqual(len(capture["force"]), 200)
        self.assertGreaterEqual(abs(capture["force"][50:]).max(), 0.05)
        self.assertEqual(capture.units, {"position": "m", "force": "N"})

    def test_blocks_of_a_recording(self):
        blocks = []
        recording = self.open().record(PATIENCE, more=lambda block: blocks.append(block) or len(blocks) < 2)
        self.assertEqual(len(blocks), 2)
        self.assertEqual(len(recording.samples), sum(map(len, blocks)))

    def test_an_exception_of_a_block(self):
        with self.assertRaises(ZeroDivisionError):
            self.open().record(PATIENCE, more=lambda block: 1 / 0)

    def test_check_and_commands(self):
        device = self.open()
        self.assertFalse(device.check({"wall.stiffness": "9 N/mm"}))
        check = device.check({"wall.stiffness": 0, "wall.damping": 0})
        self.assertIn("colgate", check.criteria)
        self.assertEqual(device.run("get", "wall.law")["wall.law"]["value"], device["wall.law"])
        with self.assertRaisesRegex(ValueError, "wall.law"):
            device.check({"wall.law": "brick"})

    def test_threads(self):
        device = self.open()
        seen = []

        def look():
            for _ in range(30):
                seen.append(device.get("wall.stiffness", "axis1.wall.law"))

        with device.armed():
            threads = [threading.Thread(target=look) for _ in range(3)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.assertEqual(len(seen), 90)
        self.assertEqual({tuple(one.items()) for one in seen}, {(("wall.stiffness", 1000.0), ("axis1.wall.law", "plain"))})

    def test_other_threads_run_while_one_waits(self):
        device = self.open()
        go, counted = threading.Event(), [0]

        def count():
            go.wait()
            while counted[0] < 1000:
                counted[0] += 1

        # Python itself does not change threads now: only whoever gives up the lock lets another one run.
        self.addCleanup(sys.setswitchinterval, sys.getswitchinterval())
        sys.setswitchinterval(1000)
        thread = threading.Thread(target=count)
        thread.start()
        go.set()
        device.wait(0.2)
        self.assertEqual(counted[0], 1000)
        thread.join()


class TakesTheForceAway(AgainstAServedDevice):
    def test_an_exception(self):
        device = self.open()
        with self.assertRaises(ZeroDivisionError):
            with device.armed():
                self.assertTrue(device.status().armed)
                1 / 0
        self.assertDisarmed(device)
        with self.assertRaises(ZeroDivisionError):
            device.force_loop(lambda sample: 1 / 0)
        self.assertDisarmed(device)
        self.assertEqual(device["drive.mode"], "haptic")

    def test_a_function_that_gives_no_force(self):
        device = self.open()
        with self.assertRaises(TypeError):
            device.force_loop(lambda sample: "much")
        with self.assertRaisesRegex(ValueError, "finite"):
            device.force_loop(lambda sample: float("nan"))
        self.assertDisarmed(device)

    def test_what_the_device_refuses_to_arm(self):
        device = self.open()
        device.set({"wall.law": "plain", "wall.side": 1, "wall.position": "here + 5 mm"})
        with self.assertRaisesRegex(kmax.RefusedError, "by more than 5.00 mm towards larger positions"):
            with device.armed():
                self.fail("it was armed")
        self.assertDisarmed(device)

    def test_another_program_that_stops(self):
        device = self.open()
        with self.assertRaisesRegex(kmax.RefusedError, "Quick stop"):
            with device.armed():
                command_line("--device", self.served.bus, "stop")
        with self.assertRaisesRegex(kmax.RefusedError, "Quick stop"):
            stopped = []
            device.force_loop(lambda sample: stopped.append(sample) or (
                len(stopped) == 20 and threading.Thread(target=device.stop).start()) or 0.1, seconds=PATIENCE)
        self.assertDisarmed(device)

    def test_a_stop_from_outside_a_loop(self):
        process = program(LOOP, self.served.bus)
        command_line("--device", self.served.bus, "stop")
        self.assertIn("the force of axis 0 is off", process.communicate(timeout=PATIENCE)[1])

    def test_a_function_that_hangs(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address) as device:
                other = self.served.bus if address == self.served.device else self.served.device
                seen = []

                def hang(sample):
                    # The interpreter's lock is held, as a long computation in C holds it, until another program sees that the
                    # force is gone.
                    seen.append(ctypes.PyDLL(None).system(
                        f"timeout {PATIENCE} '{sys.executable}' -c '{UNTIL_DISARMED}' '{other}'".encode()))
                    return 0.0

                with self.assertRaisesRegex(kmax.WatchdogError, "longer than 0.05 s"):
                    device.force_loop(hang, watchdog=0.05)
                self.assertEqual(seen, [0])
                self.assertDisarmed(device)

    def test_ctrl_c(self):
        for text in WALL, LOOP:
            with self.subTest(text):
                process = program(text, self.served.bus)
                process.send_signal(signal.SIGINT)
                self.assertIn("KeyboardInterrupt", process.communicate(timeout=PATIENCE)[1])
                with kmax.Device(self.served.bus) as device:
                    self.assertDisarmed(device)

    def test_kill(self):
        """By the device's own time: a tick later than link.timeout after the kill finds no force."""
        for text in LOOP, WALL:
            for own, other in ("bus", "device"), ("device", "bus"):
                with self.subTest(own=own, text=text), Served() as served, kmax.Device(getattr(served, other)) as device:
                    process = program(text, getattr(served, own))
                    self.assertTrue(device.status().armed)
                    process.kill()
                    process.communicate()
                    killed, late = device["measured.tick"], False
                    while not late:
                        # Looked at after the tick was: the tick is no later than the force.
                        tick = device["measured.tick"]
                        status, force = device.status(), device["measured.force"]
                        late = (tick - killed) % 2**32 > 1.01 * TICKS_PER_SECOND
                    self.assertFalse(status.armed)
                    self.assertEqual(force, 0)
                    self.assertIn("link.timeout", status.words)

    def test_after_a_kill_everything_works_again(self):
        process = program(LOOP, self.served.bus)
        process.kill()
        process.communicate()
        device = self.open()
        while device.status().armed:
            device.wait(0.05)
        device.clear()
        self.assertGreater(len(device.record(0.2).time), 0)
        record = device.force_loop(lambda sample: 0.0, seconds=0.2)
        self.assertGreater(len(record.time), 0)
        self.assertEqual(device["rpdo3.mapped_count"], 0)
        self.assertEqual(device["tpdo1.transmission_type"], 255)
        self.assertGreater(len(device.record(0.2).time), 0)

    def test_a_device_that_is_unplugged(self):
        for armed in False, True:
            for address in "bus", "device":
                with self.subTest(address, armed=armed), Served() as served:
                    device = kmax.Device(getattr(served, address))
                    with self.assertRaises(kmax.Error):
                        if armed:
                            with device.armed():
                                served.process.kill()
                                device.wait(PATIENCE)
                        else:
                            device.force_loop(lambda sample: served.process.kill() or 0.0, seconds=PATIENCE)
                    device.close()

    def test_a_fork(self):
        device = self.open()
        with device.armed():
            child = os.fork()
            if child == 0:
                try:
                    device["wall.law"]
                    os._exit(1)
                except kmax.Error as error:
                    device.close()
                    os._exit(0 if "fork" in str(error) else 2)
            self.assertEqual(os.waitpid(child, 0)[1], 0)
            self.assertTrue(device.status().armed)

    def test_without_keeping_it_alive(self):
        device = self.open()
        device["link.timeout"] = 0.2
        device.arm(keep_alive=False)
        time.sleep(0.3)
        while device.status().armed:  # reading keeps it alive, if the device has not been too slow for it already
            time.sleep(0.3)
        self.assertTrue(device.status().faulty)
        self.assertIn("link", device.disarm())
        device.clear()


class Loops(AgainstAServedDevice):
    def test_the_force_asked_for_is_made(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address) as device:
                forces = []

                def pull(sample):
                    forces.append(sample.force)
                    return None if sample.force < -0.29 else -0.3

                record = device.force_loop(pull)
                self.assertAlmostEqual(forces[-1], -0.3, delta=0.01)
                self.assertAlmostEqual(record.force[-1], -0.3)
                self.assertTrue((record.round_trip > 0).all())
                self.assertTrue((record.lateness >= 0).all())
                self.assertTrue((np.diff(record.time) > 0).all())
                self.assertDisarmed(device)

    def test_the_rates(self):
        device = self.open()
        record = device.force_loop(lambda sample: 0.0, seconds=0.5)
        self.assertEqual(record.rate, 1000)
        self.assertEqual(len(record.time) + record.missed, 500)
        record = device.force_loop(lambda sample: 0.0, seconds=0.5, rate=200, keep=10)
        self.assertEqual(record.rate, 200)
        self.assertEqual(len(record.time), 10)
        with self.assertRaisesRegex(ValueError, "1 to 1000 Hz"):
            device.force_loop(lambda sample: 0.0, rate=2000)

    def test_what_its_function_may_do(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address) as device:
                def pull(sample):
                    device["wall.stiffness"] = 432
                    return None

                device.force_loop(pull, watchdog=PATIENCE / 10)
                self.assertEqual(device["wall.stiffness"], 432)
                with self.assertRaisesRegex(kmax.RefusedError, "from within another call"):
                    device.record(PATIENCE, more=lambda block: device.record(1))
                with self.assertRaisesRegex(kmax.Error, "cannot be closed from within"):
                    device.force_loop(lambda sample: device.close())
                self.assertDisarmed(device)

    def test_closing_in_another_thread(self):
        for address in self.served.bus, self.served.device:
            with self.subTest(address), kmax.Device(address) as device:
                closer = threading.Thread(target=device.close)

                def pull(sample):
                    if closer.ident is None:
                        closer.start()
                    return 0.1

                with self.assertRaisesRegex(kmax.Error, "closed by another thread"):
                    device.force_loop(pull)
                closer.join()
                self.assertFalse(device.is_open)
                with kmax.Device(address) as again:
                    self.assertDisarmed(again)

    def test_what_is_in_its_way(self):
        device = self.open()
        device["link.timeout"] = 0
        with self.assertRaisesRegex(kmax.RefusedError, "link.timeout is 0"):
            device.force_loop(lambda sample: 0.0)
        device["link.timeout"] = 1
        with device.armed(), self.assertRaisesRegex(kmax.RefusedError, "armed already"):
            device.force_loop(lambda sample: 0.0)


class Simulates(unittest.TestCase):
    def test_a_scene(self):
        scene = kmax.run_scene("touch", {"wall.stiffness": "0.5 N/mm"})
        self.assertEqual(scene.contact, "stable")
        self.assertEqual(len(scene["time"]), len(scene["force"]))
        self.assertIn("touch", kmax.scenes())
        with self.assertRaisesRegex(ValueError, "tuch"):
            kmax.run_scene("tuch")

    def test_an_experiment(self):
        document = kmax.experiment("jitter", touches=1)
        self.assertEqual(document["origin"], "predicted")
        self.assertGreater(len(document["pairs"]), 0)
        with self.assertRaisesRegex(ValueError, "touches"):
            kmax.experiment("jitter", touches=0)

    def test_a_check(self):
        self.assertFalse(kmax.check({"wall.stiffness": "9 N/mm"}))


if __name__ == "__main__":
    unittest.main()
