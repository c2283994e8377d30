"""kmax does over CAN what it does over a serial line: each command that needs a device, over both lines of one board,
and several programs on one bus."""

import csv
import json
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from board_on_bus import BoardOnBus, Holding
from kmax_under_test import KMAX, PATIENCE, kmax

READINGS = 10
REPORT_TICKS = 4  # how often the ticks report to the main loop, which has PDOs sent

# What differs between two readings of one device, or between two links, and so is not compared.
MOVES = {"device", "uptime", "tick", "duration_s", "time_s", "readings", "current_a", "counters",
         # Modbus only: its device identification has more objects than CANopen's.
         "product_code", "vendor_name",
         # Each link's own state and counters.
         "can"}


def compared(document, left_out=MOVES):
    if isinstance(document, dict):
        return {name: compared(value, left_out) for name, value in document.items() if name not in left_out}
    if isinstance(document, list):
        return [compared(value, left_out) for value in document]
    return document


def fell_silent(code, said):
    """Whether a recording ended since the computer was too busy to run the board for so long that the recorder took it
    for silent. It is made again: how busy the computer is must not decide."""
    return code == 1 and "no complete set of PDOs" in said


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.board = BoardOnBus().__enter__()
        cls.addClassCleanup(cls.board.__exit__)

    def both(self, *arguments):
        """The command over CAN and over the serial line: exit code, document or text, messages."""
        outcomes = []
        for device in (self.board.can_device, self.board.device):
            done = kmax(*arguments, device=device, check=False)
            document = json.loads(done.stdout) if "--json" in arguments else done.stdout
            outcomes.append((done.returncode, document, done.stderr.replace(device, "DEVICE")))
        return outcomes

    def alike(self, *arguments, code=0):
        (can_code, can, can_said), (line_code, line, line_said) = self.both(*arguments)
        self.assertEqual((can_code, line_code), (code, code), can_said + line_said)
        self.assertEqual(compared(can), compared(line))
        self.assertEqual(can_said, line_said)
        return can

    def test_info(self):
        info = self.alike("info", "--json")
        self.assertEqual(info["info"]["core_clock"], 168_000_000)

    def test_list_and_get(self):
        (_, can, _), (_, line, _) = self.both("list", "--all", "--json")
        self.assertEqual(set(can), set(line))
        # Readings change by themselves; all else of them, and every parameter, is the same.
        self.assertGreater(sum(entry["access"] == "rw" for entry in can.values()), 200)
        for name in can:
            left_out = {"value"} if can[name]["access"] == "ro" else set()
            self.assertEqual(compared(can[name], left_out), compared(line[name], left_out), name)
        self.alike("get", "wall.stiffness", "axis1.motor.kind", "encoder.counts_per_turn")
        self.alike("list", "wall.", "--long")

    def test_refusals_in_the_same_words_and_all_or_nothing(self):
        for arguments in (["get", "wall.stifness"], ["set", "wall.damping=3", "wall.stiffness=2e6"],
                          ["set", "measured.force=1"], ["set", "wall.law=magnet"],
                          ["set", "wall.damping=3", "haptic.rate=999"], ["set", "canopen.heartbeat_time=9"],
                          ["capture", "--channels", "nonsense"], ["arm", "--axis", "7"]):
            with self.subTest(arguments=arguments):
                self.alike(*arguments, code=2)
        damping = self.alike("get", "wall.damping", "--json")
        self.assertEqual(damping["wall.damping"]["value"], 0)

    def test_what_is_set_over_one_is_read_over_the_other(self):
        names = ["wall.damping", "axis1.wall.magnetic_coefficient", "wall.side"]
        self.board.kmax("set", *(f"{name}={value}" for name, value in zip(names, ("1.25", "3.5", "-1"))))
        self.assertEqual([entry["value"] for entry in self.alike("get", *names, "--json").values()],
                         [1.25, 3.5, "-1"])
        kmax("set", *(f"{name}={value}" for name, value in zip(names, ("0", "2", "1"))), device=self.board.device)
        self.assertEqual([entry["value"] for entry in self.alike("get", *names, "--json").values()], [0, 2, "+1"])

    def test_save_and_defaults(self):
        for device in (self.board.can_device, self.board.device):
            with self.subTest(device=device):
                kmax("set", "wall.damping=1.5", device=device)
                saved = json.loads(kmax("save", "--json", device=device).stdout)
                self.assertTrue(saved["read_back_equal"])
                kept = self.alike("info", "--json")["store"]
                self.assertEqual((kept["unsaved_parameters"], kept["sequence"]), (0, saved["record"]))
                before = self.parameters()
                changed = json.loads(kmax("defaults", "--json", device=device).stdout)["changed"]
                self.assertEqual(changed["wall.damping"]["before"], 1.5)
                self.assertEqual(self.alike("get", "wall.damping", "--json")["wall.damping"]["value"], 0)
                for name in changed:  # what the scene's hardware needs
                    self.assertEqual(before[name], changed[name]["before"])
                back = {name: value for name, value in before.items() if name in changed and name != "wall.damping"}
                kmax("set", *(f"{name}={value}" for name, value in back.items()), device=device)

    def parameters(self):
        shown = self.board.json("list", "--all")
        return {name: entry["value"] for name, entry in shown.items() if entry["access"] == "rw"}

    def test_drive(self):
        for device in (self.board.can_device, self.board.device):
            with self.subTest(device=device):
                def state(*command, device=device):
                    return json.loads(kmax(*command, "--axis", "0", "--json", device=device).stdout)["axes"][0]["state"]

                self.assertEqual(state("arm"), "operation_enabled")
                self.assertIn("switch_on_disabled", state("disarm"))
                self.assertEqual(state("arm"), "operation_enabled")
                self.assertIn(state("stop"), ("quick_stop_active", "switch_on_disabled"))
                self.assertEqual(state("disarm"), "switch_on_disabled")
                self.assertEqual(state("clear"), "switch_on_disabled")
        self.alike("state", "--json")

    def test_watch(self):
        reading = self.alike("watch", "--for", "0", "--json")
        self.assertEqual([axis["state"] for axis in reading["axes"]], ["switch_on_disabled"] * 2)

    def test_capture_and_record(self):
        with tempfile.TemporaryDirectory() as folder:
            for kind, arguments in (("capture", ("--samples", "200", "--out")), ("record", ("--for", "0.2"))):
                tables = []
                for device in (self.board.can_device, self.board.device):
                    file = Path(folder) / f"{kind}.csv"
                    for _ in range(10):
                        done = kmax(kind, *arguments, str(file), device=device, check=False)
                        if not fell_silent(done.returncode, done.stderr):
                            break
                    self.assertEqual(done.returncode, 0, done.stderr)
                    with file.open() as rows:
                        tables.append(list(csv.DictReader(rows)))
                self.assertTrue(all(tables), kind)
                # A serial line reads one axis after the other, and says when.
                self.assertEqual(set(tables[1][0]) - set(tables[0][0]), {"axis1_tick"} if kind == "record" else set())
                self.assertLessEqual(set(tables[0][0]), set(tables[1][0]))
                ticks = [int(row["tick"]) for row in tables[0]]
                steps = [after - before for before, after in zip(ticks, ticks[1:])]
                if kind == "record":
                    # The first is sent when the node is started, by the last report; the others on a grid.
                    self.assertTrue(20 <= steps[0] <= 20 + REPORT_TICKS, steps[:5])
                    self.assertEqual(set(steps[1:]), {20})
                else:
                    self.assertEqual(set(steps), {1})
                self.assertEqual(len(ticks), 200)

    def self_test(self, device):
        """Its report. Where the computer is too busy to run kmax and the board in time, kmax says that the test could not
        be carried out, and it is made again: how busy it is must not decide."""
        for _ in range(10):
            done = kmax("selftest", "--json", device=device, check=False, timeout=600)
            if done.returncode in (0, 3):
                return json.loads(done.stdout)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.fail(f"10 self-tests could not be carried out; the last one: {done.stdout}{done.stderr}")

    def test_selftest(self):
        can, line = ([(check["name"], check["verdict"]) for check in self.self_test(device)["checks"]]
                     for device in (self.board.can_device, self.board.device))
        self.assertEqual([name for name, _ in can], [name for name, _ in line])
        # Of a link is judged whether its answers come in time.
        self.assertEqual([check for check in can if check[0] != "link"],
                         [check for check in line if check[0] != "link"])


class SeveralPrograms(unittest.TestCase):
    def test_a_second_reads_while_the_first_records(self):
        with tempfile.TemporaryDirectory() as folder, BoardOnBus() as board:
            for _ in range(10):
                told, ticks = self.recording_beside_readings(board, Path(folder) / "rows.csv")
                if told is not None:
                    break
            self.assertIsNotNone(told, "10 recordings ended in silence")
            self.assertEqual(told["rows"], len(ticks))
            # Each frame of the second program lets the main loop look at once whether PDOs are due, up to a report's
            # ticks sooner than it does by itself. What a recorder that is held up loses is counted.
            steps = [after - before for before, after in zip(ticks, ticks[1:])]
            periods = [max(1, round(step / 20)) for step in steps]
            odd = [step for step, count in zip(steps, periods) if abs(step - 20 * count) > REPORT_TICKS]
            self.assertEqual(odd, [])
            self.assertEqual(told["rows_lost"], sum(periods) - len(periods))

    def recording_beside_readings(self, board, file):
        """What the recorder told, and its rows' ticks; no such thing where the board fell silent."""
        file.unlink(missing_ok=True)
        with subprocess.Popen([KMAX, "--device", board.can_device, "record", str(file), "--json"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as recorder:
            self.addCleanup(recorder.kill)
            end = time.monotonic() + PATIENCE
            while (not file.exists() or file.stat().st_size < 1000) and time.monotonic() < end:
                time.sleep(0.05)
            for _ in range(READINGS):
                self.assertEqual(board.json("get", "wall.stiffness")["wall.stiffness"]["value"], 2000)
            recorder.send_signal(signal.SIGINT)
            said, complaints = recorder.communicate(timeout=PATIENCE)
        if fell_silent(recorder.returncode, complaints):
            return None, []
        self.assertEqual(recorder.returncode, 0, complaints)
        with file.open() as rows:
            return json.loads(said), [int(row["tick"]) for row in csv.DictReader(rows)]

    def test_a_second_stops_what_the_first_holds(self):
        with BoardOnBus() as board:
            with Holding(0) as holding:
                board.kmax("stop", "--axis", "0")
                said, code = holding.ended()
            self.assertEqual(code, 1)
            self.assertIn("the force is off", said)
            self.assertFalse(board.axis()["armed"])
            with Holding(0) as first, Holding(1) as second:
                self.assertEqual(first.interrupt()[1], 0)
                self.assertTrue(board.axis(1)["armed"])
                self.assertEqual(second.interrupt()[1], 0)


if __name__ == "__main__":
    sys.exit(unittest.main())
