"""What candump of can-utils hears on the guest's CAN interface, and frames sent with its cansend."""

import os
import re
import subprocess
import threading
import time
from pathlib import Path
from typing import NamedTuple

from kmax_under_test import PATIENCE

INTERFACE = os.environ.get("KMAX_TEST_CAN", "vcan0")


class Frame(NamedTuple):
    time: float  # s since the epoch, the kernel's
    id: int
    data: bytes
    extended: bool = False
    remote: bool = False


def parse(line):
    """A line of `candump -L`, for example `(1700000000.123456) vcan0 181#0102` (CAN FD has ## and a flag digit)."""
    match = re.match(r"^\((\d+\.\d+)\) \S+ ([0-9A-F]+)#(?:#[0-9A-F])?(R?)([0-9A-F]*)", line)
    if not match:
        raise ValueError(f"not a line of candump -L: {line!r}")
    stamp, identifier, remote, data = match.groups()
    # A remote frame has a length behind its R, and no data.
    return Frame(float(stamp), int(identifier, 16), b"" if remote else bytes.fromhex(data), len(identifier) == 8,
                 bool(remote))


def send(text):
    """One frame in cansend's notation, e.g. `000#0101`."""
    subprocess.run(["cansend", INTERFACE, text], check=True, capture_output=True, text=True, timeout=PATIENCE)


class CanCapture:
    """Every frame on the bus from the moment the block is entered, in order.

    with CanCapture() as capture:
        send("601#40181001")
        reply = capture.wait_for(lambda frame: frame.id == 0x581)
    """

    def __init__(self, *filters):
        """`filters` as candump has them behind the interface's name, e.g. `700:780`."""
        self._target = ",".join([INTERFACE, *filters])
        self._frames = []
        self._heard = threading.Condition()

    def __enter__(self):
        before = _listeners()
        # -r: the kernel's own buffer holds 300 frames, and whoever fills a bus without pause is not interrupted.
        self._process = subprocess.Popen(["candump", "-L", "-ta", "-r", "8000000", self._target],
                                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        end = time.monotonic() + PATIENCE
        while _listeners() <= before:
            if self._process.poll() is not None or time.monotonic() > end:
                self._process.kill()
                raise AssertionError(f"candump {self._target} does not listen: {self._process.stdout.read()}")
            time.sleep(0.005)
        self._reader.start()
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._reader.join(timeout=PATIENCE)
        self._process.wait(timeout=PATIENCE)
        self._process.stdout.close()

    def _read(self):
        for line in self._process.stdout:
            with self._heard:
                self._frames.append(parse(line))
                self._heard.notify_all()

    def frames(self, identifier=None):
        """What was heard so far, all or one identifier's."""
        with self._heard:
            return [frame for frame in self._frames if identifier in (None, frame.id)]

    def wait_for(self, wanted, seconds=PATIENCE, count=1):
        """The first frame, or the list of the first `count`, for which `wanted(frame)` holds, heard before or yet to
        come."""
        with self._heard:
            def found():
                return [frame for frame in self._frames if wanted(frame)][:count]

            if not self._heard.wait_for(lambda: len(found()) == count, seconds):
                heard = "\n".join(f"{frame.time:.6f} {frame.id:X}#{frame.data.hex()}" for frame in self._frames[-20:])
                raise AssertionError(f"{len(found())} of {count} frames within {seconds} s; the last heard:\n{heard}")
            return found() if count > 1 else found()[0]


def _listeners():
    """How many receivers the kernel has on the interface: a frame sent earlier than candump's own is lost to it."""
    return sum(len(re.findall(rf"^ *{INTERFACE} ", path.read_text(), re.M))
               for path in Path("/proc/net/can").glob("rcvlist_*"))
