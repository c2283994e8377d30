"""Every command with --json on the simulated device, and the stream of kmax view, by the schemas in docs/json."""

import base64
import copy
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import json_schemas
from kmax_under_test import ELF, KMAX, PATIENCE, Serve, kmax

STREAM_PAGE = json_schemas.FOLDER.parent / "view.md"
# They need GPIO lines: tests/system/guest/lines_test.py.
WITH_LINES = {"lines", "lines watch", "lines set", "reset", "bootloader"}


def commands(path=()):
    """All that have --json, by their help: ("experiment", "contact")."""
    text = kmax(*path, "--help").stdout
    options = re.split(r"^Options:$", text, flags=re.M)
    if path and re.search(r"^  --json\b", text, re.M):
        yield path
    for title, rows in re.findall(r"^([A-Z][^\n]*):\n((?:  .*\n)+)", options[0], re.M):
        if title != "Arguments" and (not path or title == "Commands"):
            for name in re.findall(r"^  ([a-z][a-z-]*)", rows, re.M):
                yield from commands((*path, name))


class Schemas(unittest.TestCase):
    def test_every_command_with_json_has_one_and_no_other_has(self):
        found = {"-".join(path) for path in commands()}
        self.assertIn("experiment-max-stiffness", found)
        self.assertIn("lines-watch", found)
        present = {path.name.removesuffix(".schema.json") for path in json_schemas.FOLDER.iterdir()}
        self.assertEqual(present - {"error", "parts", "stream"}, found,
                         "docs/json/COMMAND.schema.json describes what a command prints with --json")

    def test_every_command_is_run_here_or_where_there_are_lines(self):
        self.assertEqual({" ".join(path) for path in commands()} - WITH_LINES, set(Documents.RUN))

    def test_each_is_a_schema_and_every_object_in_it_is_closed(self):
        def objects(schema):
            if isinstance(schema, dict):
                if schema.get("type") == "object":
                    yield schema
                schema = list(schema.values())
            if isinstance(schema, list):
                for one in schema:
                    yield from objects(one)

        for path in sorted(json_schemas.FOLDER.iterdir()):
            schema = json.loads(path.read_text())
            with self.subTest(path.name):
                json_schemas.Validator.check_schema(schema)
                self.assertTrue(schema["title"])
                # Those of parts that others add to are closed by them.
                if path.name in ("parts.schema.json", "stream.schema.json"):
                    continue
                for one in objects(schema):
                    self.assertTrue(one.keys() & {"additionalProperties", "unevaluatedProperties"}, one)


def without_each_key(document):
    """The document without one of its keys, without another, ...; and with one that does not belong there."""
    def places(part, path=()):
        if isinstance(part, dict):
            yield path, None
            for key, value in part.items():
                yield path, key
                yield from places(value, (*path, key))
        if isinstance(part, list):
            for index, value in enumerate(part[:2]):
                yield from places(value, (*path, index))

    for path, key in places(document):
        changed = copy.deepcopy(document)
        at = changed
        for step in path:
            at = at[step]
        if key is None:
            at["no such key"] = {}
        else:
            del at[key]
        yield f"{'/'.join(map(str, path))}: {'added' if key is None else key}", changed


class Documents(unittest.TestCase):
    """RUN: what each command is given, with a place for a folder and for the device where it needs them."""

    SIM = ("--device", "sim")
    RUN = {
        "devices": [()],
        "info": [()],
        "state": [(), ("--axis", "1")],
        "arm": [()],
        "disarm": [()],
        "stop": [()],
        "clear": [()],
        "faults": [()],
        "list": [("--all",), ("--changed",)],
        "get": [("wall.stiffness", "axis1.wall.law", "measured.position")],
        "set": [("wall.damping=3", "wall.law=magnetic", "wall.position=here-20mm")],
        "dump": [("FOLDER/d.toml",), ("-",)],
        "load": [("FOLDER/d.toml", "--dry-run"), ("FOLDER/other.toml",)],
        "diff": [("FOLDER/d.toml",), ("FOLDER/other.toml",)],
        "save": [()],
        "defaults": [()],
        "lock": [("--code-file", "FOLDER/code")],
        "unlock": [("--code-file", "FOLDER/code")],
        "view": None,  # Stream
        "watch": [("--for", "0.2"), ("--for", "0", "--axis", "1")],
        "record": [("FOLDER/r.csv", "--for", "0.2")],
        "capture": [("--samples", "50", "--channels", "position,force,current"),
                    ("--samples", "50", "--out", "FOLDER/c.csv")],
        "plot": [("FOLDER/r.csv", "--out", "FOLDER/r.svg")],
        "bring-up": [("--list",), (*SIM, "--yes", "--supply", "24", "--report", "FOLDER/b.json")],
        "calibrate": None,  # Calibrating
        "selftest": [SIM],
        "wall": [("--position", "0"), ("--csv", "FOLDER/points.csv", "--out", "FOLDER/forces.csv"),
                 ("--picture", "FOLDER/w.svg")],
        "check": [(), ("--set", "wall.law=magnetic", "--set", "guard.damping=0.5", "--hand", "subject_1"), ("--explain",),
                  ("--set", "structure.stiffness=2.31N/mm"),
                  ("--map", "wall.stiffness=100..10000,4", "--map", "guard.damping=0.1..10,4", "--csv", "FOLDER/m.csv")],
        "simulate": [("touch",), ("touch", "--set", "motion.approach_speed=0.05"), ("--keys",)],
        "sweep": [("touch", "--set", "wall.stiffness=1000,2000", "--set", "wall.law=plain,magnetic"),
                  ("touch", "--set", "wall.stiffness=1000", "--out", "FOLDER/s.csv")],
        "experiment max-stiffness": [(*SIM, "--conditions", "0,instant")],
        "experiment contact": [(*SIM, "--trials", "1")],
        "experiment wall-test": [(*SIM, "--repeats", "1", "--stiffness", "1000,6000")],
        "experiment jitter": [(*SIM, "--touches", "1")],
        "experiment deviation": [(*SIM, "--pulses", "1", "--out", "FOLDER/deviation")],
        "experiment resolution": [(*SIM, "--touches", "1", "--speeds", "0.05,0.3")],
        "design wall": [("--subjects", "FOLDER/one.toml", "--delay", "0.2ms"),
                        ("--subjects", "FOLDER/one.toml", "--depth", "0.001mm"),
                        ("--subjects", "FOLDER/one.toml", "--shard", "1/9", "--out", "FOLDER/shares")],
        "serve": None,  # Serving
        "flash": [("--dry-run", "--method", "dfu", ELF), ("--dry-run", "--method", "openocd-stlink", "--factory-reset")],
        "describe": [(), ("--format", "json")],
        "completion": [("bash",), ("fish",)],
        "manual": [("FOLDER",)],
    }
    LINES = {"watch"}  # a document on each line
    VERDICTS = {"diff", "check", "design wall", "bring-up", "calibrate", "selftest"}  # 3: it is no

    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.board = cls.enterClassContext(Serve())
        path = Path(cls.folder)
        (path / "code").write_text("123456\n")
        (path / "one.toml").write_text("[[subject]]\n")
        (path / "other.toml").write_text('[wall]\ndamping = 4.5\n')
        (path / "points.csv").write_text("position_m,velocity_m_per_s\n0,0\n-0.001,0.1\n")

    def documents(self, command, arguments):
        given = [one.replace("FOLDER", self.folder) for one in arguments]
        done = kmax(*command.split(), *given, "--json", device=self.board.device, check=False, timeout=10 * PATIENCE)
        self.assertIn(done.returncode, (0, 3) if command in self.VERDICTS else (0,), done.stdout + done.stderr)
        texts = done.stdout.splitlines() if command in self.LINES else [done.stdout]
        self.assertTrue(texts, command)
        return [json.loads(text) for text in texts]

    def test_each_command_s(self):
        for command, runs in self.RUN.items():
            for arguments in runs or []:
                with self.subTest(command=command, arguments=arguments):
                    for document in self.documents(command, arguments):
                        json_schemas.check(self, document, command.replace(" ", "-"))

    def test_a_key_more_or_less_is_a_problem(self):
        for command, arguments in (("info", ()), ("state", ()), ("check", ()), ("capture", ("--samples", "4")),
                                   ("selftest", self.SIM), ("experiment deviation", (*self.SIM, "--pulses", "1"))):
            document = self.documents(command, arguments)[0]
            name = command.replace(" ", "-")
            passed = [what for what, changed in without_each_key(document) if not json_schemas.problems(changed, name)]
            # Readings and texts by the dictionary's names, whichever there are.
            free = re.compile(r"^(info|counters|identity|can)?: ") if command == "info" else re.compile(r": (values|grip|delay_s|"
                                                                                                      r"without_stiffening)$")
            self.assertEqual([what for what in passed if not free.search(what)], [], command)

    def test_a_fault_in_the_state_and_in_the_log(self):
        with Serve() as board:
            kmax("set", "link.timeout=0.05", "wall.position=here-50mm", device=board.device)
            kmax("arm", device=board.device)
            end = time.monotonic() + PATIENCE
            while True:
                text = kmax("state", "--json", device=board.device).stdout
                if json.loads(text)["axes"][0]["fault"]:
                    break
                self.assertLess(time.monotonic(), end)
                time.sleep(0.1)
            json_schemas.check(self, json.loads(text), "state")
            log = json.loads(kmax("faults", "--json", device=board.device).stdout)
            self.assertEqual([entry["event"] for entry in log["entries"]], ["fault"])
            json_schemas.check(self, log, "faults")
            refused = json.loads(kmax("selftest", "--json", device=board.device, check=False, timeout=10 * PATIENCE).stdout)
            self.assertIsNotNone(refused["fault_at_start"])
            json_schemas.check(self, refused, "selftest")
            json_schemas.check(self, json.loads(kmax("faults", "--clear", "--json", device=board.device).stdout), "faults")

    def test_errors_are_documents_of_one_form(self):
        wrong = [(2, "no-such-command"), (2, "get", "no.such.name"), (2, "get"), (2, "set", "wall.stiffness=-1", *self.SIM),
                 (2, "simulate", "no_such_scene"), (2, "check", "--map", "wall.stiffness=1..2", "--csv", "m.csv"), (2, "lines", "set"),
                 (2, "describe", "--format", "poem"), (2, "plot", "/nowhere/r.csv"), (2, "serve"), (2, "arm"), (2, "state", "--axis", "9"),
                 (1, "info", "--device", "serial:/nowhere"), (1, "watch", "--device", "can:/nowhere"), (1, "dump", "/nowhere/d.toml")]
        for code, *arguments in wrong:
            with self.subTest(arguments):
                done = kmax(*arguments, "--json", check=False)
                self.assertEqual(done.returncode, code, done.stdout + done.stderr)
                document = json.loads(done.stdout)
                json_schemas.check(self, document, "error")
                said = done.stderr.replace("\n  ", " ")
                self.assertIn(document["error"].splitlines()[0], said)


class Calibrating(unittest.TestCase):
    def test_steps_that_pass_and_that_fail(self):
        with Serve("--scene", "gimbal_a") as board:
            for arguments, code in (("--dry-run", "--steps", "electrical"), 0), (("--steps", "encoder", "--travel", "1mm"), 3):
                done = kmax("calibrate", *arguments, "--json", device=board.device, check=False, timeout=10 * PATIENCE)
                self.assertEqual(done.returncode, code, done.stdout + done.stderr)
                json_schemas.check(self, json.loads(done.stdout), "calibrate")


class Serving(unittest.TestCase):
    def test_serve_says_where_before_it_serves(self):
        with tempfile.TemporaryDirectory() as folder:
            with subprocess.Popen([KMAX, "serve", "--serial", f"{folder}/line", "--can", f"{folder}/bus", "--json"],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
                try:
                    document = first_document(process.stdout)
                    self.assertEqual(len(document["devices"]), 2)
                    json_schemas.check(self, document, "serve")
                finally:
                    process.send_signal(signal.SIGINT)
                    process.communicate(timeout=PATIENCE)


def first_document(stream):
    text = ""
    while not text.endswith("\n}\n"):
        line = stream.readline()
        if not line:
            raise AssertionError(f"no document: {text}")
        text += line
    return json.loads(text)


class WebSocket:
    """A client of RFC 6455, as far as texts go."""

    def __init__(self, port, token):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /stream HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\nAuthorization: Bearer {token}\r\n\r\n").encode())
        self.reader = self.socket.makefile("rb")
        if b" 101 " not in self.reader.readline():
            raise AssertionError("the stream was not opened")
        while self.reader.readline() != b"\r\n":
            pass

    def send(self, message):
        self.send_frame(0x81, json.dumps(message).encode())

    def send_frame(self, kind, payload):
        mask = os.urandom(4)
        length = bytes([0x80 | len(payload)]) if len(payload) < 126 else struct.pack(">BH", 0x80 | 126, len(payload))
        self.socket.sendall(bytes([kind]) + length + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload)))

    def receive(self):
        text = b""
        while True:
            kind, length = self.reader.read(2)
            if length == 126:
                length = struct.unpack(">H", self.reader.read(2))[0]
            elif length == 127:
                length = struct.unpack(">Q", self.reader.read(8))[0]
            payload = self.reader.read(length)
            if kind == 0x89:  # ping
                self.send_frame(0x8A, payload)
            elif kind == 0x88:
                raise AssertionError(f"the stream was closed: {payload}")
            else:
                text += payload
                if kind & 0x80:
                    return json.loads(text)

    def close(self):
        self.reader.close()
        self.socket.close()


class Stream(unittest.TestCase):
    def test_the_page_s_examples(self):
        text = STREAM_PAGE.read_text()
        sent, heard = text.split("### What a client hears")
        examples = [[json.loads(one) for one in re.findall(r"```json\n(.*?)```", part, re.S)] for part in (sent, heard)]
        self.assertGreater(min(map(len, examples)), 8)
        for part, messages in zip(("sent", "heard"), examples):
            for message in messages:
                json_schemas.check(self, message, "stream", f"#/$defs/{part}")
        for message in (*examples[0], *examples[1]):
            for part in ("sent", "heard"):
                self.assertNotEqual(json_schemas.problems({**message, "more": 1}, "stream", f"#/$defs/{part}"), [], message)

    SENT = [{"type": "set", "values": {"wall.law": "adaptive", "wall.position": "here-30mm"}, "id": "law"},
            {"type": "map", "up": "guard.damping", "id": 2},
            {"type": "capture", "channels": ["position", "flags"], "samples": 20, "id": 3},
            {"type": "capture", "trigger": "fault", "samples": 20, "id": 4},
            {"type": "arm", "id": 5}, {"type": "stop", "id": 6}, {"type": "disarm", "id": 7}, {"type": "clear", "id": 8},
            {"type": "revert", "id": 9}, {"type": "save", "id": 10}]
    KINDS = {"welcome", "reply", "device", "state", "stopped", "parameters", "rows", "curve", "judgement", "map", "capture"}

    def converse(self, client, heard):
        """Sends SENT and a message that there is not, one when the one before has been answered, and hears every kind."""
        waiting = [*self.SENT, {"type": "dance", "id": "last"}]
        asked = None
        captured = False
        end = time.monotonic() + PATIENCE
        while waiting or asked or not captured or {message["type"] for message in heard} != self.KINDS:
            self.assertLess(time.monotonic(), end, f"{asked} {waiting} {sorted({message['type'] for message in heard})}")
            # The second capture would take the first one's place.
            if asked is None and waiting and (captured or waiting[0]["id"] != 4):
                asked = waiting.pop(0)
                client.send(asked)
            heard.append(client.receive())
            captured = captured or heard[-1].get("phase") == "complete"
            if asked and heard[-1]["type"] == "reply" and heard[-1]["id"] == asked["id"]:
                asked = None

    def test_what_is_heard(self):
        with Serve() as board, subprocess.Popen([KMAX, "view", "--json", "--device", board.device], stdout=subprocess.PIPE,
                                                stderr=subprocess.PIPE, text=True) as process:
            try:
                document = first_document(process.stdout)
                json_schemas.check(self, document, "view")
                port = int(re.search(r":(\d+)/", document["stream"])[1])
                client = WebSocket(port, document["token"])
                self.addCleanup(client.close)
                heard = []
                self.converse(client, heard)
            finally:
                process.send_signal(signal.SIGINT)
                process.communicate(timeout=PATIENCE)
        for message in self.SENT:
            json_schemas.check(self, message, "stream", "#/$defs/sent")
        # Judged at leisure: who reads too slowly loses the connection.
        for message in heard[::max(1, len(heard) // 300)] + [one for one in heard if one["type"] not in ("rows", "state")]:
            json_schemas.check(self, message, "stream", "#/$defs/heard")


if __name__ == "__main__":
    sys.exit(unittest.main())
