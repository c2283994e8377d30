"""The programs under test as context managers, and kmax as a function. Run by ctest with KMAX, KMAX_BOARD and, for
the image, KMAX_ELF and KMAX_QEMU_BOARD in the environment."""

import json
import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

PATIENCE = 60  # s, for what comes in a moment unless the machine is slow or busy; success does not wait for it

POWER_STAGE_READY = 6000  # ticks, of which 20,000 are a second

KMAX = os.environ.get("KMAX", "build/native/kmax")
BOARD = os.environ.get("KMAX_BOARD", "build/native/kmax-board")
ELF = os.environ.get("KMAX_ELF", "build/stm32f405/kmax-odrive_v3.elf")


def kmax(*arguments, device=None, check=True, timeout=2 * PATIENCE):
    """Runs kmax to its end; returns the finished process."""
    environment = dict(os.environ)
    environment.pop("KMAX_DEVICE", None)
    if device:
        environment["KMAX_DEVICE"] = device
    done = subprocess.run([KMAX, *arguments], capture_output=True, text=True, env=environment, timeout=timeout)
    if check and done.returncode != 0:
        raise AssertionError(f"kmax {' '.join(arguments)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def kmax_json(*arguments, **options):
    return json.loads(kmax(*arguments, "--json", **options).stdout)


def wait_for(path):
    end = time.monotonic() + PATIENCE
    while not path.exists():
        if time.monotonic() > end:
            raise AssertionError(f"{path} did not appear")
        time.sleep(0.02)


class _Process:
    """A process that offers a serial line, LINK in its command, and perhaps a bus, BUS, under names of its own."""

    def __init__(self, command):
        self.folder = tempfile.TemporaryDirectory()
        self.link = Path(self.folder.name) / "line"
        self.process = subprocess.Popen([part.replace("LINK", str(self.link)).replace("BUS", str(self.link.parent / "bus"))
                                         for part in command],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        end = time.monotonic() + PATIENCE
        while not self.link.exists():
            if self.process.poll() is not None or time.monotonic() > end:
                self.process.kill()
                raise AssertionError(f"{command} did not come up:\n{self.process.communicate()[0]}")
            time.sleep(0.02)

    @property
    def device(self):
        return f"serial:{self.link}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.said = self.process.communicate(timeout=PATIENCE)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.said = self.process.communicate()[0]
        self.folder.cleanup()


class Serve(_Process):
    """kmax serve: the native firmware with a simulated device."""

    def __init__(self, *options):
        super().__init__([KMAX, "serve", "--serial", "LINK", *options])


class QemuBoard(_Process):
    """The ARM image for QEMU: the board's without what QEMU does not have."""

    def __init__(self):
        super().__init__([os.environ["KMAX_QEMU_BOARD"], os.path.join(os.path.dirname(ELF), "kmax-qemu.elf"), "LINK"])


class VirtualBoard(_Process):
    """The ARM image on the virtual board, at real speed."""

    def __init__(self, *options):
        super().__init__([BOARD, ELF, "--serial", "LINK", *options])
        self.wait_until_it_answers()

    def wait_until_it_answers(self, device=None):
        """Until its image has started, power stage and all, which takes its own time."""
        end = time.monotonic() + PATIENCE
        while True:
            done = kmax("get", "info.tick", "--json", device=device or self.device, check=False)
            if done.returncode == 0 and json.loads(done.stdout)["info.tick"]["value"] > POWER_STAGE_READY:
                return
            if time.monotonic() > end or (done.returncode != 0 and "no answer" not in done.stderr):
                self.process.kill()
                raise AssertionError(f"the board does not answer: {done.stderr}{self.process.communicate()[0]}")


class Holding:
    """`kmax arm --hold`, from when the axis is armed to the end of the block, where it is killed if it still runs."""

    def __init__(self, device, axis=0):
        self.process = subprocess.Popen([KMAX, "--device", device, "arm", "--hold", "--axis", str(axis)],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def __enter__(self):
        first = self.process.stdout.readline()
        if "Operation enabled" not in first:
            raise AssertionError(f"it was not armed: {first}{self.process.communicate(timeout=PATIENCE)[0]}")
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate(timeout=PATIENCE)

    def ended(self):
        """What it said after arming, and its exit code, once it has ended by itself."""
        said = self.process.communicate(timeout=PATIENCE)[0]
        return said, self.process.returncode

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)
        return self.ended()


def registers():
    """The generated register map: {name: {"table", "address", "words"}}."""
    document = json.loads(kmax("describe", "--format", "json").stdout)
    return {entry["name"]: entry["modbus"] for entry in document["objects"]}
