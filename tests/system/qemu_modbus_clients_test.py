"""mbpoll and kmax against the firmware on a foreign ARM core: its image for QEMU, over the emulated USART.

QEMU's line can lose a character when the machine is busy; a client's retry is part of Modbus, so a time-out
is forgiven a few times. A wrong value never is."""

import sys
import time
import unittest

from kmax_under_test import QemuBoard, kmax, kmax_json, registers
from mbpoll_session import mbpoll

PATIENCE = 8
FORGIVING = {"tries": PATIENCE, "patience_s": 1}


def eventually(action):
    for attempt in range(PATIENCE):
        try:
            return action()
        except AssertionError as error:
            if "no answer" not in str(error) or attempt == PATIENCE - 1:
                raise
            time.sleep(0.2)


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.board = QemuBoard().__enter__()
        cls.places = registers()

    @classmethod
    def tearDownClass(cls):
        cls.board.__exit__()

    def test_kmax_knows_the_board_and_its_dictionary(self):
        info = eventually(lambda: kmax_json("info", device=self.board.device))
        self.assertEqual(info["info"]["core_clock"], 168000000)
        self.assertEqual(info["info"]["clock_source"], "unreadable")

    def test_mbpoll_writes_and_reads_back(self):
        stiffness = self.places["wall.stiffness"]["address"]
        mbpoll(self.board.link, "holding", stiffness, values=[3580], **FORGIVING)
        self.assertEqual(mbpoll(self.board.link, "holding", stiffness, **FORGIVING), [3580.0])

    def test_what_kmax_sets_mbpoll_reads(self):
        eventually(lambda: kmax_json("set", "wall.law=adaptive", "wall.adaptive_gain=1.5", device=self.board.device))
        gain = self.places["wall.adaptive_gain"]["address"]
        self.assertEqual(mbpoll(self.board.link, "holding", gain, **FORGIVING), [1.5])
        law = self.places["wall.law"]["address"]
        self.assertEqual(mbpoll(self.board.link, "holding", law, kind="word", **FORGIVING), [3.0])

    def test_the_tick_runs(self):
        tick = self.places["info.tick"]["address"]
        first = mbpoll(self.board.link, "input", tick, kind="int", **FORGIVING)[0]
        second = mbpoll(self.board.link, "input", tick, kind="int", **FORGIVING)[0]
        self.assertGreater(second, first)

    def test_an_axis_without_an_encoder_is_not_armed(self):
        eventually(lambda: kmax_json("get", "info.tick", device=self.board.device))
        for _ in range(PATIENCE):
            done = kmax("arm", device=self.board.device, check=False)
            if "no answer" not in done.stderr:
                break
        self.assertEqual(done.returncode, 1)
        self.assertIn("encoder", done.stderr)
        state = eventually(lambda: kmax_json("state", "--axis", "0", device=self.board.device))
        self.assertEqual(state["axes"][0]["state"], "switch_on_disabled")


if __name__ == "__main__":
    sys.exit(unittest.main())
