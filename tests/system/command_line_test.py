"""kmax as a user runs it: the contract of its output and exit codes, and what happens on bad input."""

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

from kmax_under_test import KMAX, PATIENCE, Holding, Serve, kmax, kmax_json


class Contract(unittest.TestCase):
    def test_get_json_is_one_document_in_si(self):
        self.assertEqual(kmax_json("get", "wall.magnetic_length"),
                         {"wall.magnetic_length": {"value": 0.001, "unit": "m"}})

    def test_describe_json_has_every_field(self):
        objects = kmax_json("describe", "--format", "json")["objects"]
        self.assertGreater(len(objects), 100)
        for entry in objects:
            self.assertEqual({"name", "index", "subindex", "type", "unit", "access", "min", "max", "default", "values",
                              "persistent", "change_while_armed", "only_commander", "ceiling", "modbus", "help"} - set(entry), set())
            self.assertIn(entry["modbus"]["table"], ("holding", "input"))
            self.assertIn(entry["modbus"]["words"], (1, 2))

    def test_the_parameter_reference_in_docs_is_this_program_s(self):
        reference = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"
        self.assertEqual(kmax("describe", "--format", "markdown").stdout, reference.read_text(),
                         "run scripts/docs")

    def test_wall_point(self):
        point = kmax_json("wall", "--set", "wall.law=magnetic", "--set", "wall.stiffness=8410", "--position", "-0.0001")
        self.assertAlmostEqual(point["force_n"], 2.841, delta=2.841e-6)
        self.assertAlmostEqual(point["magnetic_force_n"], 2.0, delta=2e-6)
        self.assertIs(point["inside"], True)

    def test_contact_experiment_on_the_simulated_device(self):
        done = kmax("experiment", "contact", "--expect-paper", "--json", check=False, timeout=10 * PATIENCE)
        result = json.loads(done.stdout)
        all_agree = all(c["agrees"] for c in result["conditions"])
        self.assertEqual(done.returncode, 0 if all_agree else 3)
        verdicts = {c["name"]: c["verdict"] for c in result["conditions"]}
        self.assertEqual(verdicts["F_MC = 0 N"], "unstable")
        self.assertEqual(verdicts["F_MC = 1 N"], "unstable")
        self.assertEqual(verdicts["F_MC = 2 N"], "stable")
        swings = {c["name"]: c["peak_to_peak_m"] for c in result["conditions"]}
        self.assertGreater(swings["F_MC = 0 N"], swings["F_MC = 1 N"])
        self.assertTrue(all(c["lost_records"] == 0 for c in result["conditions"]))


class WallTable(unittest.TestCase):
    def test_a_million_rows_equal_row_by_row_calls(self):
        random.seed(5)
        with tempfile.TemporaryDirectory() as folder:
            table, out = Path(folder) / "in.csv", Path(folder) / "out.csv"
            rows = [(f"{random.uniform(-2e-3, 2e-2):.9g}", f"{random.uniform(-3, 3):.9g}") for _ in range(1_000_000)]
            table.write_text("position_m,velocity_m_per_s\n" + "\n".join(",".join(r) for r in rows) + "\n")
            law = ["--set", "wall.law=adaptive", "--set", "wall.stiffness=5500", "--set", "wall.damping=2"]
            begin = time.monotonic()
            kmax("wall", "--csv", str(table), "--out", str(out), *law)
            print(f"a million rows took {time.monotonic() - begin:.2f} s")
            lines = out.read_text().splitlines()
            self.assertEqual(len(lines), 1_000_001)
            self.assertEqual(lines[0], "position_m,velocity_m_per_s,force_n")
            for index in random.sample(range(1_000_000), 100):
                position, velocity = rows[index]
                point = kmax_json("wall", "--position", position, "--velocity", velocity, *law)
                self.assertEqual(float(lines[index + 1].split(",")[2]), point["force_n"])

    def test_a_bad_row_is_named_and_nothing_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            table, out = Path(folder) / "in.csv", Path(folder) / "out.csv"
            table.write_text("position_m,velocity_m_per_s\n0,0\n0.1,fast\n")
            done = kmax("wall", "--csv", str(table), "--out", str(out), check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("in.csv:3", done.stderr)
            self.assertIn("fast", done.stderr)
            self.assertEqual(os.listdir(folder), ["in.csv"])


class BadInput(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.board = Serve().__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.board.__exit__()

    def refused(self, *arguments, code=2):
        done = kmax(*arguments, device=self.board.device, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def value(self, name):
        return kmax_json("get", name, device=self.board.device)[name]["value"]

    def test_out_of_range_names_value_and_range_and_changes_nothing(self):
        before = self.value("wall.damping")
        message = self.refused("set", "wall.damping=7", "wall.stiffness=2e6")
        for part in ("wall.stiffness", "2e6", "1e6", "N/m"):
            self.assertIn(part, message)
        self.assertEqual(self.value("wall.damping"), before)

    def test_wrong_type_unknown_name_and_read_only(self):
        self.assertIn("stiff", self.refused("set", "wall.stiffness=stiff"))
        self.assertIn("magnetic", self.refused("set", "wall.law=magnet"))
        self.assertIn("wall.stiffness", self.refused("get", "wall.stifness"))
        self.assertIn("measured.force", self.refused("set", "measured.force=1"))
        for text in ("nan", "inf", "", "1e99", "3 apples"):
            self.refused("set", f"wall.stiffness={text}")

    def test_a_rule_between_parameters_is_kept_as_a_whole(self):
        message = self.refused("set", "wall.stiffness=1234", "haptic.rate=999", code=2)
        self.assertIn("20000", message)
        self.assertNotEqual(self.value("wall.stiffness"), 1234)
        kmax("set", "wall.adaptive_force_min=3", "wall.adaptive_force_max=4", device=self.board.device)
        kmax("set", "wall.adaptive_force_max=2", "wall.adaptive_force_min=0.8", device=self.board.device)

    def arm(self):
        # The person of the scene may still be pressing from an earlier trial, whose force is gone.
        end = time.monotonic() + PATIENCE
        while True:
            done = kmax("arm", device=self.board.device, check=False)
            if done.returncode == 0:
                return
            self.assertIn("inside the wall", done.stderr)
            self.assertLess(time.monotonic(), end)
            time.sleep(0.2)

    def test_while_armed_says_so(self):
        kmax("set", "link.timeout=60", device=self.board.device)
        self.arm()
        try:
            message = kmax("set", "wall.stiffness=900", "wall.side=-1", device=self.board.device, check=False).stderr
            self.assertIn("armed", message)
            self.assertIn("wall.side", message)
            self.assertNotEqual(self.value("wall.stiffness"), 900)
            kmax("set", "wall.stiffness=900", device=self.board.device)
            message = kmax("set", "wall.stiffness=1600", device=self.board.device, check=False).stderr
            for part in ("armed", "can only be lowered from 900 N/m", "wall.stiffness_ceiling (0 N/m)"):
                self.assertIn(part, message)
            self.assertEqual(self.value("wall.stiffness"), 900)
        finally:
            kmax("disarm", device=self.board.device)
            kmax("set", "wall.stiffness=1000", "link.timeout=1", device=self.board.device)

    def test_silence_of_the_host_removes_the_force(self):
        kmax("set", "link.timeout=1", device=self.board.device)
        self.arm()
        # Its time may pass slower than here, and each question ends the silence: ever longer ones.
        for silence in (1.2, 2.4, 5, 10, 20, 40):
            time.sleep(silence)
            state = kmax_json("state", "--axis", "0", device=self.board.device)["axes"][0]
            if state["state"] == "fault":
                break
        self.assertEqual(state["state"], "fault")
        self.assertEqual(state["fault"]["name"], "link_silent")
        kmax("clear", device=self.board.device)

    def test_garbage_on_the_line_does_no_harm(self):
        descriptor = os.open(self.board.link, os.O_RDWR | os.O_NOCTTY)
        try:
            random.seed(7)
            for _ in range(20):
                os.write(descriptor, random.randbytes(random.randrange(1, 300)))
                time.sleep(0.01)
            # What is written is not yet received.
            end = time.monotonic() + PATIENCE
            while kmax("get", "wall.stiffness", device=self.board.device, check=False).returncode != 0:
                self.assertLess(time.monotonic(), end, "it does not answer any more")
        finally:
            os.close(descriptor)
        self.assertEqual(self.value("wall.stiffness"), 1000)

    def test_two_writers_take_turns(self):
        errors = []

        def write(stiffness, damping):
            for _ in range(5):
                done = kmax("set", f"wall.stiffness={stiffness}", f"wall.damping={damping}", device=self.board.device,
                            check=False)
                if done.returncode != 0:
                    errors.append(done.stderr)

        threads = [threading.Thread(target=write, args=pair) for pair in ((1100, 1), (2200, 2))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(errors, [])
        self.assertIn((self.value("wall.stiffness"), self.value("wall.damping")), ((1100, 1), (2200, 2)))
        kmax("set", "wall.stiffness=1000", "wall.damping=0", device=self.board.device)


class Stopping(unittest.TestCase):
    def test_stop_from_another_terminal_takes_the_force_away_from_a_holding_one(self):
        with Serve() as board:
            kmax("set", "link.timeout=60", device=board.device)
            with Holding(board.device) as holding:
                kmax("set", "wall.stiffness=900", device=board.device)
                kmax("stop", device=board.device)
                said, code = holding.ended()
            self.assertEqual(code, 1)
            self.assertIn("the force is off", said)

    def test_ctrl_c_leaves_the_drive_disarmed(self):
        with Serve() as board:
            kmax("set", "link.timeout=60", device=board.device)
            with Holding(board.device) as holding:
                said, code = holding.interrupt()
            self.assertEqual(code, 0, said)
            state = kmax_json("state", "--axis", "0", device=board.device)["axes"][0]
            self.assertEqual(state["state"], "switch_on_disabled")

    def test_an_interrupted_experiment_puts_the_parameters_back(self):
        with Serve() as board:
            def values():
                # Beside the experiment the port is free for moments only, which a busy machine may miss.
                end = time.monotonic() + PATIENCE
                while True:
                    done = kmax("get", "wall.stiffness", "wall.law", "haptic.rate", device=board.device, check=False)
                    if done.returncode == 0:
                        return done.stdout
                    self.assertIn("in use", done.stderr)
                    self.assertLess(time.monotonic(), end)

            before = values()
            with subprocess.Popen([KMAX, "experiment", "contact", "--no-prompt", "--device", board.device],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as running:
                self.addCleanup(running.kill)
                self.assertIn("1 of ", running.stdout.readline())
                self.assertNotEqual(values(), before)
                running.send_signal(signal.SIGINT)
                said = running.communicate(timeout=PATIENCE)[0]
            self.assertEqual(running.returncode, 1, said)
            self.assertIn("interrupted", said)
            self.assertEqual(values(), before)


class RoundTrips(unittest.TestCase):
    def test_reading_one_parameter_takes_two(self):
        """What its dictionary is, and the value: the time of a command on a slow line (docs/modbus.md)."""
        with Serve() as board:
            first, second = (int(kmax_json("get", "counters.frames_received", device=board.device)
                                 ["counters.frames_received"]["value"]) for _ in range(2))
            self.assertEqual(second - first, 2)


class ClosedStreams(unittest.TestCase):
    """Whoever starts a program may close its standard streams: the next file it opens would get their numbers."""

    def test_what_is_said_goes_into_no_file(self):
        with tempfile.TemporaryDirectory() as folder:
            store, link = Path(folder) / "store", Path(folder) / "line"
            with Serve("--store", str(store)) as serve:
                kmax("set", "wall.stiffness=1234", device=serve.device)
                kmax("save", device=serve.device)
            kept = store.read_bytes()
            for closed in (">&- 2>&-", "<&- >&-", "<&- >&- 2>&-"):
                with subprocess.Popen(["sh", "-c", f"exec {KMAX} serve --serial {link} --store {store} {closed}"]) as serve:
                    end = time.monotonic() + PATIENCE
                    while not link.is_symlink() and time.monotonic() < end:
                        time.sleep(0.01)
                    value = kmax_json("get", "wall.stiffness", device=f"serial:{link}")["wall.stiffness"]["value"]
                    serve.send_signal(signal.SIGTERM)
                    serve.wait(PATIENCE)
                self.assertEqual(value, 1234, closed)
                self.assertEqual(store.read_bytes(), kept, closed)

    def test_an_output_that_is_closed_is_a_failure(self):
        for command in ("get wall.stiffness", "list", "--help", "record - --for 0.1", "watch --for 0.1"):
            done = subprocess.run(["sh", "-c", f"exec {KMAX} --device sim {command} >&-"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1, command)
            self.assertIn("written", done.stderr, command)


class VanishingPort(unittest.TestCase):
    def test_a_server_that_dies_in_mid_command_ends_it_with_a_message(self):
        with Serve() as board:
            kmax("set", "link.timeout=60", device=board.device)
            with Holding(board.device) as holding:
                board.process.send_signal(signal.SIGKILL)
                said, code = holding.ended()
            self.assertEqual(code, 1)
            self.assertIn(str(board.link), said)

    def test_a_port_that_is_not_there(self):
        done = kmax("info", device="serial:/nowhere/at/all", check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/at/all", done.stderr)
        document = json.loads(kmax("info", "--json", device="serial:/nowhere/at/all", check=False).stdout)
        self.assertIn("/nowhere/at/all", document["error"])


if __name__ == "__main__":
    sys.exit(unittest.main())
