"""The npm package `canopen`, a CANopen master that was not written here, against the image on the virtual board; what
joins them; and its reader of data sheets. scripts/install_node_packages installs it."""

import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from kmax_under_test import PATIENCE, VirtualBoard, kmax, kmax_json

FOLDER = Path(__file__).resolve().parent / "node_canopen"
CLIENT = FOLDER.parents[2] / "build" / "node_canopen" / "node_modules"


def frame(identifier, data):
    return struct.pack("=IB3x8s", identifier, len(data), data)


class Bridge:
    """bus_bridge.py between a bus's socket and a stream socket of its own."""

    def __init__(self, bus):
        self._folder = tempfile.TemporaryDirectory()
        self.stream = str(Path(self._folder.name) / "stream")
        self.process = subprocess.Popen([sys.executable, str(FOLDER / "bus_bridge.py"), str(bus), self.stream],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def __enter__(self):
        if self.process.stdout.readline() != "ready\n":
            raise AssertionError(f"the bridge did not come up: {self.process.communicate()[1]}")
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()
        self._folder.cleanup()


class BusBridge(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = str(Path(folder.name) / "bus")
        self.bus = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.addCleanup(self.bus.close)
        self.bus.bind(self.path)
        self.bus.listen()
        self.bus.settimeout(PATIENCE)

    def accepted(self):
        """The next client of the bus that stays: the bridge tries first whether there is a bus."""
        connection, _ = self.bus.accept()
        connection.settimeout(PATIENCE)
        self.addCleanup(connection.close)
        return connection

    def connected(self, bridge):
        stream = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.addCleanup(stream.close)
        stream.settimeout(PATIENCE)
        stream.connect(bridge.stream)
        return stream

    def read(self, stream, size):
        data = b""
        while len(data) < size:
            part = stream.recv(size - len(data))
            self.assertTrue(part, "the stream has ended")
            data += part
        return data

    def test_frames_go_both_ways_one_message_each(self):
        with Bridge(self.path) as bridge:
            self.accepted()
            stream = self.connected(bridge)
            node = self.accepted()
            sent = [frame(0x600 + i, bytes(range(i))) for i in range(9)]
            stream.sendall(b"".join(sent))
            self.assertEqual([node.recv(100) for _ in sent], sent)
            for message in sent:
                node.send(message)
            self.assertEqual(self.read(stream, 16 * len(sent)), b"".join(sent))

    def test_a_frame_that_comes_in_pieces(self):
        with Bridge(self.path) as bridge:
            self.accepted()
            stream = self.connected(bridge)
            node = self.accepted()
            whole = frame(0x123, b"abcdefgh") + frame(0x124, b"")
            for cut in (whole[:1], whole[1:15], whole[15:17], whole[17:]):
                stream.sendall(cut)
            self.assertEqual(node.recv(100) + node.recv(100), whole)

    def test_each_program_is_a_node_and_may_leave(self):
        with Bridge(self.path) as bridge:
            self.accepted()
            first, second = self.connected(bridge), self.connected(bridge)
            first_node, second_node = self.accepted(), self.accepted()
            first.sendall(frame(1, b"1"))
            second.sendall(frame(2, b"2"))
            self.assertEqual((first_node.recv(100), second_node.recv(100)), (frame(1, b"1"), frame(2, b"2")))
            first.close()
            self.assertEqual(first_node.recv(100), b"")
            second_node.send(frame(3, b"3"))
            self.assertEqual(self.read(second, 16), frame(3, b"3"))

    def test_when_the_bus_goes_the_bridge_ends(self):
        with Bridge(self.path) as bridge:
            self.accepted()
            stream = self.connected(bridge)
            self.accepted().close()
            self.assertEqual(bridge.process.wait(PATIENCE), 1)
            self.assertIn("gone", bridge.process.stderr.read())
            self.assertEqual(stream.recv(1), b"")

    def test_no_bus(self):
        done = subprocess.run([str(FOLDER / "bus_bridge.py"), "/nowhere/bus", "/nowhere/stream"], capture_output=True,
                              text=True, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/bus", done.stderr)


def run_script(test, script, *arguments):
    """Runs a script of the folder to its end, and returns what it prints."""
    node = shutil.which("node")
    test.assertTrue(node, "node is missing: Debian package nodejs")
    done = subprocess.run([node, str(FOLDER / script), *map(str, arguments)], capture_output=True, text=True,
                          timeout=10 * PATIENCE, check=False)
    test.assertEqual(done.returncode, 0, done.stdout + done.stderr)
    return done.stdout


@unittest.skipUnless(CLIENT.exists(), f"left out: {CLIENT} is not installed (scripts/install_node_packages)")
class EdsReader(unittest.TestCase):
    TYPES = {"float32": "REAL32"}  # the others have the same name in both

    def setUp(self):
        with tempfile.NamedTemporaryFile("w", suffix=".eds") as file:
            file.write(kmax("describe", "--format", "eds").stdout)
            file.flush()
            self.read = json.loads(run_script(self, "eds_reader.mjs", file.name))

    def test_values_are_those_of_the_dictionary(self):
        objects = {(read["index"], read["subindex"]): read for read in self.read["objects"]}
        entries = kmax_json("describe")["objects"]
        for entry in entries:
            with self.subTest(entry["name"]):
                read = objects[entry["index"], entry["subindex"]]
                self.assertEqual(entry["name"], read["name"])
                self.assertEqual(self.TYPES.get(entry["type"], entry["type"].upper()), read["type"])
                self.assertEqual(entry["access"] == "ro", read["access"] == "ro")
                default = read.get("default")
                if default is None:
                    self.assertTrue(entry["access"] == "ro" or entry["type"] == "float32")
                elif "$NODEID" not in default and not entry["values"]:
                    self.assertEqual(entry["default"], read["value"])
        self.assertGreater(len(objects), len(entries))

    def test_the_device(self):
        device = self.read["device"]
        self.assertEqual(["Kmax", 4, 5, True],
                         [device[key] for key in ("productName", "nrOfRXPDO", "nrOfTXPDO", "lssSupported")])
        self.assertEqual([125000, 250000, 500000, 1000000], device["baudRates"])
        self.assertEqual({f"Dummy{number:04X}": "1" for number in range(1, 8)}, device["dummyUsage"])


@unittest.skipUnless(CLIENT.exists(), f"left out: {CLIENT} is not installed (scripts/install_node_packages)")
class Master(unittest.TestCase):
    def master(self, argument):
        """Every step's line is shown where one failed."""
        printed = run_script(self, "master.mjs", argument)
        self.assertIn(" 0 FAILED", printed)
        return printed

    def test_the_master_itself(self):
        self.assertIn("ok SDO block, 2000 bytes", self.master("--stand-in"))

    def test_the_image_on_the_virtual_board(self):
        with tempfile.TemporaryDirectory() as folder:
            bus = os.path.join(folder, "bus")
            with VirtualBoard("--can", bus), Bridge(bus) as bridge:
                self.assertIn(" 0 left out", self.master(bridge.stream))


if __name__ == "__main__":
    sys.exit(unittest.main())
