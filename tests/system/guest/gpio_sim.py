"""The lines of the guest's simulated GPIO chip: from the outside, where a board or a person is (SimulatedLine), and
from the inside, where programs of the host are (held)."""

import os
import re
import signal
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

from kmax_under_test import PATIENCE

CHIP = os.environ.get("KMAX_TEST_GPIO", "")
FOLDER = Path(os.environ.get("KMAX_TEST_GPIO_SIM", "/nowhere"))


def line_numbers():
    """{name: number} of the chip's lines."""
    shown = subprocess.run(["gpioinfo", CHIP], check=True, capture_output=True, text=True, timeout=PATIENCE).stdout
    return {name: int(number) for number, name in re.findall(r'^\s*line\s+(\d+):\s+"([^"]+)"', shown, re.M)}


class SimulatedLine:
    """The wire at a line: as an input of the guest's programs it has the level that drive() gives it, as an output
    the level that they set."""

    def __init__(self, name):
        self.name = name
        self.number = line_numbers()[name]
        self._folder = FOLDER / f"sim_gpio{self.number}"

    def level(self):
        return int((self._folder / "value").read_text())

    def drive(self, level):
        (self._folder / "pull").write_text("pull-up" if level else "pull-down")

    def wait_for(self, level, seconds=PATIENCE):
        """A program sets its output when it comes to it."""
        end = time.monotonic() + seconds
        while self.level() != level:
            if time.monotonic() > end:
                raise AssertionError(f"{self.name} is not {level} within {seconds} s")
            time.sleep(0.002)

    def users(self):
        """The program that holds the line, as gpioinfo names it, or None."""
        shown = subprocess.run(["gpioinfo", CHIP], check=True, capture_output=True, text=True, timeout=PATIENCE).stdout
        user = re.search(rf'^\s*line\s+{self.number}:\s+\S+\s+(?:"([^"]*)"|unused)', shown, re.M)
        return user[1]


@contextmanager
def held(**levels):
    """Holds lines as outputs, as a program of the host does: `with held(NRST=0): ...`. Afterwards they are what
    is driven from outside, or their pull."""
    numbers = line_numbers()
    settings = [f"{numbers[name]}={level}" for name, level in levels.items()]
    process = subprocess.Popen(["gpioset", "-m", "signal", CHIP, *settings], stderr=subprocess.PIPE, text=True)
    try:
        for name in levels:
            line = SimulatedLine(name)
            end = time.monotonic() + PATIENCE
            while line.users() is None:
                if process.poll() is not None or time.monotonic() > end:
                    process.kill()
                    raise AssertionError(f"gpioset does not get {name}: {process.communicate()[1]}")
                time.sleep(0.005)
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stderr.close()
