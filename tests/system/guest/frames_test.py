"""What candump hears of a board is what the EDS of kmax describe promises, frame by frame."""

import sys
import unittest

from board_on_bus import BoardOnBus, Holding
from can_capture import CanCapture, send
from gpio_sim import held
from kmax_under_test import kmax
from promised_frames import PromisedFrames

NODE = 1
TICK_RATE = 20000
REPORT_TICKS = 4  # how often the ticks report to the main loop, which has PDOs sent
STATES = {0x00: "boot-up", 0x04: "stopped", 0x05: "operational", 0x7F: "pre-operational"}
HOST = {0x000, 0x600 + NODE}


def sdo_upload(capture, index, subindex):
    """The bytes of an expedited upload, by hand."""
    request = bytes([0x40, index & 0xFF, index >> 8, subindex])

    def answers(frame):
        return frame.id == 0x580 + NODE and frame.data[1:4] == request[1:4]

    before = len([frame for frame in capture.frames() if answers(frame)])
    send(f"{0x600 + NODE:03X}#{request.hex()}00000000")
    reply = capture.wait_for(answers, count=before + 1)
    reply = reply[-1] if before else reply
    if reply.data[1:4] != request[1:4] or reply.data[0] & 0xE3 != 0x43:
        raise AssertionError(f"{index:04X}:{subindex} is answered with {reply.data.hex()}")
    return reply.data[4:8 - (reply.data[0] >> 2 & 3)]


def settle(capture):
    """Until all that the node sent so far has been heard: it is asked twice, since its first reply may overtake a frame
    of a higher identifier that waits for the bus."""
    for _ in range(2):
        sdo_upload(capture, 0x1000, 0)


def sdo_download(capture, index, subindex, value):
    """Writes 16 bits."""
    request = bytes([0x2B, index & 0xFF, index >> 8, subindex, value & 0xFF, value >> 8, 0, 0])

    def answers(frame):
        # Replies of somebody else's transfer just before may still be on their way here.
        return frame.id == 0x580 + NODE and frame.data[1:4] == request[1:4]

    before = len([frame for frame in capture.frames() if answers(frame)])
    send(f"{0x600 + NODE:03X}#{request.hex()}")
    capture.wait_for(answers, count=before + 1)
    reply = [frame for frame in capture.frames() if answers(frame)][before]
    if reply.data != bytes([0x60]) + request[1:4] + bytes(4):
        raise AssertionError(f"{request.hex()} is answered with {reply.data.hex()}")


class Frames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.promised = PromisedFrames(kmax("describe", "--format", "eds").stdout, NODE)
        cls.lengths = cls.promised.lengths()

    def check_each(self, frames):
        """No frame that is not promised, and none of another length."""
        for frame in frames:
            with self.subTest(frame=frame):
                self.assertFalse(frame.extended or frame.remote)
                if frame.id in HOST:
                    continue
                self.assertIn(frame.id, self.lengths)
                self.assertEqual(len(frame.data), self.lengths[frame.id])
                if frame.id == self.promised.heartbeat:
                    self.assertIn(frame.data[0], STATES)

    def test_what_is_promised_is_that_of_the_predefined_connection_set(self):
        self.assertEqual(self.lengths, {0x701: 1, 0x581: 8, 0x081: 8, 0x181: 8, 0x281: 8, 0x381: 8, 0x481: 8, 0x501: 6})

    def test_a_whole_session(self):
        with CanCapture() as capture, BoardOnBus() as board:
            sdo_download(capture, 0x1017, 0, 20)
            capture.wait_for(lambda frame: frame.id == 0x701 and frame.data == b"\x7F", count=5)
            send("000#0101")
            capture.wait_for(lambda frame: frame.id == 0x701 and frame.data == b"\x05", count=5)
            with Holding():
                with held(ESTOP=0):
                    capture.wait_for(lambda frame: frame.id == 0x081 and frame.data[:2] == b"\x02\xFF")
            board.kmax("clear")
            capture.wait_for(lambda frame: frame.id == 0x081 and frame.data[:2] == b"\x00\x00")
            send("000#0201")
            capture.wait_for(lambda frame: frame.id == 0x701 and frame.data == b"\x04", count=5)
            beats = len([frame for frame in capture.frames(0x701) if frame.data == b"\x7F"])
            send("000#8001")
            capture.wait_for(lambda frame: frame.id == 0x701 and frame.data == b"\x7F", count=beats + 1)
            sdo_download(capture, 0x1017, 0, 0)
            settle(capture)
            beats = len(capture.frames(0x701))
            board.kmax("info")
            settle(capture)
            frames = capture.frames()
        self.check_each(frames)
        kinds = {frame.id for frame in frames}
        self.assertEqual(kinds - HOST, set(self.lengths), "each promised identifier was heard")
        # States in the order they were asked for; PDOs in operational only; no SDO when stopped.
        states = [frame.data[0] for frame in frames if frame.id == 0x701]
        self.assertEqual([state for at, state in enumerate(states) if at == 0 or states[at - 1] != state],
                         [0x00, 0x7F, 0x05, 0x04, 0x7F])
        self.assertEqual(len(states), beats, "no heartbeat after its time was set to 0")
        started = next(at for at, frame in enumerate(frames) if frame.id == 0 and frame.data[0] == 1)
        stopped = next(at for at, frame in enumerate(frames) if frame.id == 0x701 and frame.data == b"\x04")
        tpdos = {pdo.identifier for pdo in self.promised.tpdos}
        heard = [at for at, frame in enumerate(frames) if frame.id in tpdos]
        self.assertTrue(started < heard[0] and heard[-1] < stopped)
        # Each reply has its request: one to one, in order, about the same object unless it goes on with a segment.
        requests = [frame for frame in frames if frame.id == 0x601]
        replies = [frame for frame in frames if frame.id == 0x581]
        initiating = [frame for frame in requests if frame.data[0] >> 5 in (1, 2)]
        answered = {frame.data[1:4] for frame in replies}
        self.assertTrue(all(frame.data[1:4] in answered for frame in initiating))
        codes = [int.from_bytes(frame.data[:2], "little") for frame in frames if frame.id == 0x081]
        self.assertEqual(codes, [0xFF02, 0x0000])

    def test_pdos_at_rest_are_what_sdo_reads_and_come_every_20_ticks(self):
        *regular, states = self.promised.tpdos
        with BoardOnBus() as board, CanCapture() as capture:
            board.kmax("set", "wall.law=none")
            send("000#0101")
            last = regular[-1].identifier
            capture.wait_for(lambda frame: frame.id == last, count=500)
            send("000#8001")
            settle(capture)
            frames = capture.frames()
            self.check_each(frames)
            for pdo in self.promised.tpdos:
                own = [frame for frame in frames if frame.id == pdo.identifier]
                self.assertEqual(pdo.event_time_ms, 0 if pdo is states else 10)
                for entry in pdo.mapped:
                    values = {pdo.parts(frame.data)[entry.name] for frame in own}
                    if entry.name.endswith("telemetry.tick"):
                        ticks = [int.from_bytes(pdo.parts(frame.data)[entry.name], "little") for frame in own]
                        steps = [(after - before) % 65536 for before, after in zip(ticks, ticks[1:])]
                        period = TICK_RATE // 1000 * pdo.event_time_ms
                        # The first is sent at the start, by the last report, the others on a grid of the ticks.
                        self.assertTrue(0 < steps[0] <= period + REPORT_TICKS, steps[:5])
                        odd = [at for at, step in enumerate(steps) if at > 0 and step != period]
                        at = frames.index(own[odd[0]]) if odd else 0
                        self.assertEqual(odd, [], f"of {len(steps)}; around the first: {frames[max(at - 12, 0):at + 12]}")
                    elif entry.name.endswith("telemetry.current"):  # has noise
                        largest = max(abs(int.from_bytes(value, "little", signed=True)) for value in values)
                        read = int.from_bytes(sdo_upload(capture, entry.index, entry.subindex), "little", signed=True)
                        self.assertLess(abs(read), 2 * largest + 10)
                    else:
                        self.assertEqual(values, {sdo_upload(capture, entry.index, entry.subindex)}, entry.name)
        # The PDOs of a period go out together.
        counts = [sum(frame.id == pdo.identifier for frame in frames) for pdo in regular]
        self.assertEqual(len(set(counts)), 1, counts)
        self.assertGreaterEqual(counts[0], 500)
        self.assertEqual(1, sum(frame.id == states.identifier for frame in frames), "nothing changed")


if __name__ == "__main__":
    sys.exit(unittest.main())
