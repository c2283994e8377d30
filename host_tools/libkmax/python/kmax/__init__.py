"""Kmax haptic devices from Python.

    import kmax

    with kmax.Device("can:can0") as device:
        device["wall.stiffness"] = "0.5 N/mm"
        with device.armed():
            recording = device.record(2.0)

Plain numbers are SI (m, s, N, A); text may have a unit. Errors: LinkError (no conversation is possible), RefusedError (the
device did not do what was asked, or took the force away), WatchdogError, all of them Error; ValueError for what cannot be
meant. Messages are those of the command line. docs/library.md shows more.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _kmax
from ._kmax import Error, LinkError, RefusedError, Sample, WatchdogError

__version__: str = _kmax.version

__all__ = ["Capture", "Check", "Criterion", "Device", "Error", "ForceRecord", "LinkError", "Recording", "RefusedError",
           "Sample", "Scene", "Status", "WatchdogError", "check", "experiment", "run", "run_scene", "scenes"]

Number = Union[float, int]
Setting = Union[float, int, str]
Floats = NDArray[np.float64]


def _text(name: str, value: Setting) -> str:
    """As the command line takes it: numbers without a digit lost."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name}: {value} is no number; give a choice by its name")
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, np.floating) and not isinstance(value, float):
        return str(value)  # the shortest text of its own type: 0.1 for a float32
    try:
        return repr(float(value))
    except TypeError:
        raise ValueError(f"{name}: {value!r} is neither a number nor text") from None


def _settings(values: Mapping[str, Setting]) -> list[tuple[str, str]]:
    if not isinstance(values, Mapping):
        raise TypeError(f"{values!r} is no mapping from names to values, such as {{'wall.stiffness': '0.5 N/mm'}}")
    return [(name, _text(name, value)) for name, value in values.items()]


@dataclass(frozen=True)
class Status:
    """The state of an axis."""

    state: str  #: CiA 402: "operation_enabled", "switch_on_disabled", "fault", ...
    armed: bool  #: it makes force
    faulty: bool
    words: str  #: what is wrong; empty if nothing is


@dataclass(frozen=True)
class Recording:
    """Samples of one axis; `samples` is a structured array of all columns."""

    samples: NDArray[Any]
    lost: int  #: over CAN: samples that should have been there and were not
    source: str  #: in words

    @property
    def time(self) -> Floats:
        """s of the device's time since the first sample."""
        return self.samples["time"]

    @property
    def position(self) -> Floats:
        """m"""
        return self.samples["position"]

    @property
    def velocity(self) -> Floats:
        """m/s"""
        return self.samples["velocity"]

    @property
    def force(self) -> Floats:
        """N"""
        return self.samples["force"]

    @property
    def current(self) -> Floats:
        """A"""
        return self.samples["current"]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Is the handle inside the wall?"""
        return (self.samples["flags"] & 1) != 0


@dataclass(frozen=True)
class Capture:
    """Samples at the device's full rate around a trigger, by channel: capture["position"]."""

    time: Floats  #: s since the trigger
    channels: dict[str, Floats]
    units: dict[str, str]

    def __getitem__(self, channel: str) -> Floats:
        return self.channels[channel]


@dataclass(frozen=True)
class ForceRecord:
    """What a force loop did; `steps` is a structured array of all columns, one row for each of its last cycles."""

    steps: NDArray[Any]
    rate: float  #: Hz
    missed: int  #: cycles left out, because the one before took too long or got no answer

    @property
    def time(self) -> Floats:
        """s of the device's time since the first cycle."""
        return self.steps["time"]

    @property
    def position(self) -> Floats:
        """m"""
        return self.steps["position"]

    @property
    def velocity(self) -> Floats:
        """m/s"""
        return self.steps["velocity"]

    @property
    def force(self) -> Floats:
        """N, asked for in each cycle."""
        return self.steps["force"]

    @property
    def measured_force(self) -> Floats:
        """N, that the device made when it measured position and velocity."""
        return self.steps["measured_force"]

    @property
    def lateness(self) -> Floats:
        """s, how much later than planned each cycle began: its jitter."""
        return self.steps["lateness"]

    @property
    def round_trip(self) -> Floats:
        """s of talking to the device in each cycle, without the function's own time."""
        return self.steps["round_trip"]


@dataclass(frozen=True)
class Criterion:
    """What a stability criterion says; numbers are None where it does not apply."""

    name: str
    passed: bool
    applies: bool
    value: float | None
    bound: float | None
    unit: str
    margin: float | None  #: how far the value is from the bound, as a part of it
    worth: str  #: "guarantee", "necessary" or "heuristic"


@dataclass(frozen=True)
class Check:
    """Will the wall of a parameter set hold still?"""

    passed: bool  #: every criterion that applies
    guaranteed: bool  #: stable with every passive hand, as far as the assumptions hold
    criteria: dict[str, Criterion]
    document: dict[str, Any]  #: as `kmax check --json` has it

    def __bool__(self) -> bool:
        return self.passed


@dataclass(frozen=True)
class Scene:
    """A simulated run; `axes` are structured arrays with a row for each haptic sample."""

    name: str
    axes: list[NDArray[Any]]
    state: str  #: CiA 402 state at the end
    fault: str  #: "none"
    contact: str  #: "stable", "unstable", "no contact"; empty without a hold that is judged
    peak_to_peak: float  #: m, of the hold
    deepest: float  #: m inside the wall

    def __getitem__(self, column: str) -> Floats:
        """Of axis 0: time, true_position, true_velocity, hand_position, position, velocity, force, applied_force."""
        return self.axes[0][column]


class Device:
    """A haptic device with its controller, by its address: "usb[:SERIAL]", "can:IFACE[?node=1]",
    "can:/PATH/OF/A/BUS", "serial:PATH[?unit=1&baud=115200]", or "sim", a simulated one in this process, whose time passes in calls only. Without
    an address that of KMAX_DEVICE.

    Safe to use from several threads, which take turns. In a fork's child it raises Error.
    """

    def __init__(self, address: str | os.PathLike[str] | None = None) -> None:
        self._device = _kmax.Device("" if address is None else os.fspath(address))

    def __enter__(self) -> Device:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Disarms what it armed and gives the link back."""
        self._device.close()

    @property
    def is_open(self) -> bool:
        return self._device.is_open

    @property
    def address(self) -> str:
        return self._device.address

    def __repr__(self) -> str:
        return f"kmax.Device({self.address!r})" if self.is_open else "<closed kmax.Device>"

    def __getitem__(self, name: str) -> Setting:
        """A parameter or reading: a number in SI, or a choice's name."""
        return self._device.get([name])[0][0]

    def __setitem__(self, name: str, value: Setting) -> None:
        self.set({name: value})

    def get(self, *names: str) -> dict[str, Setting]:
        """Several at once."""
        return {name: value for name, (value, _) in zip(names, self._device.get(list(names)))}

    def unit(self, name: str) -> str:
        """The unit of a parameter's plain numbers; empty if it has none."""
        return self._device.get([name])[0][1]

    def set(self, values: Mapping[str, Setting]) -> None:
        """All in one tick of the device, or none of them: {"wall.law": "plain", "wall.stiffness": "0.5 N/mm"}."""
        self._device.set(_settings(values))

    def status(self, axis: int = 0) -> Status:
        return Status(*self._device.status(axis))

    def arm(self, axis: int = 0, keep_alive: bool = True) -> None:
        """Lets the axis make force until disarm() or close(). armed() sees to that by itself.

        keep_alive: a thread says that this process lives. Without it only calls do, and the device removes the force after
        link.timeout without one.
        """
        self._device.arm(axis, keep_alive)

    @contextmanager
    def armed(self, axis: int = 0, keep_alive: bool = True) -> Iterator[Device]:
        """The axis makes force within the block, however that ends. RefusedError at its end if the force was gone before."""
        self.arm(axis, keep_alive)
        try:
            yield self
        except BaseException:
            self.disarm(axis)
            raise
        trouble = self.disarm(axis)
        if trouble:
            raise RefusedError(trouble)

    def disarm(self, axis: int = 0) -> str:
        """Takes the force away. Returns what took it away before; empty if nothing did."""
        return self._device.disarm(axis)

    def stop(self, axis: int = 0) -> None:
        """Quick stop."""
        self._device.stop(axis)

    def clear(self, axis: int = 0) -> bool:
        """Resets a fault; False if there was none."""
        return self._device.clear(axis)

    def wait(self, seconds: Number) -> None:
        """Lets time pass. RefusedError if an axis that is armed here loses its force meanwhile."""
        self._device.wait(float(seconds))

    def record(self, seconds: Number, axis: int = 0,
               more: Callable[[NDArray[Any]], bool | None] | None = None) -> Recording:
        """Over CAN 1000 samples a second, over other links as fast as they go. `more` gets each block of samples as it comes,
        about ten a second; False ends the recording."""
        return Recording(*self._device.record(float(seconds), axis, more))

    def capture(self, channels: Sequence[str] = ("position", "velocity", "force", "current"), *, axis: int = 0,
                trigger: str = "now", level: Number = 1, samples: int = 0, pre_trigger: int = 0, interval: int = 1,
                patience: Number = 30, when_ready: Callable[[], object] | None = None) -> Capture:
        """One to four channels at the device's full rate around a trigger: now, contact, force, velocity, fault or
        excitation. `when_ready` is called when the device looks for it, `patience` s long."""
        return Capture(*self._device.capture(list(channels), axis, trigger, float(level), samples, pre_trigger, interval,
                                             float(patience), when_ready))

    def force_loop(self, function: Callable[[Sample], Number | None], seconds: Number | None = None, *,
                   rate: Number | None = None, watchdog: Number = 0.1, axis: int = 0,
                   keep: int = 1_000_000) -> ForceRecord:
        """Calls the function with a Sample in each cycle, and makes the force that it returns, N at the handle along +x. None
        ends the loop. It arms before and disarms after, however it ends.

        rate: Hz; without it 1000 over CAN of 1 Mbit/s, over a serial line what that can carry. watchdog: s that the function
        may take; after that the axis is disarmed at once and WatchdogError raised when it returns. keep: as many of the last
        cycles are in the record, 64 bytes each.
        """
        return ForceRecord(*self._device.force_loop(function, None if seconds is None else float(seconds),
                                                    None if rate is None else float(rate), float(watchdog), axis, keep))

    def check(self, parameters: Mapping[str, Setting] | None = None, *, hand: str = "none", axis: int = 0) -> Check:
        """Stability criteria for the device's parameters with these in place of its own. Sets nothing. hand: none,
        subject_1, or a TOML file."""
        return _check(self.run, parameters, hand, axis)

    def experiment(self, name: str, **options: Any) -> dict[str, Any]:
        """An experiment on this device, with the command line's options: experiment("contact", trials=1)."""
        return _experiment(self.run, name, options)

    def run(self, *arguments: str) -> dict[str, Any]:
        """Any command of the command line on this device; its JSON document, with "verdict" for what says yes or no."""
        return _document(*self._device.command(list(arguments)))


def _document(verdict: bool, text: str) -> dict[str, Any]:
    document = json.loads(text)
    return {"verdict": verdict, **document} if isinstance(document, dict) else {"verdict": verdict, "document": document}


def _check(run: Callable[..., dict[str, Any]], parameters: Mapping[str, Setting] | None, hand: str, axis: int) -> Check:
    arguments = ["check", "--hand", hand, "--axis", str(axis)]
    for name, value in _settings(parameters or {}):
        arguments += ["--set", f"{name}={value}"]
    document = run(*arguments)
    criteria = {one["name"]: Criterion(one["name"], one["pass"], one["applies"], one["value"], one["bound"], one["unit"],
                                       one["margin"], one["worth"]) for one in document["criteria"]}
    return Check(document["pass"], document["guaranteed"], criteria, document)


def _experiment(run: Callable[..., dict[str, Any]], name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    arguments = ["experiment", name]
    for option, value in options.items():
        flag = "--" + option.replace("_", "-")
        if value is True:
            arguments.append(flag)
        elif value is not False and value is not None:
            arguments += [flag, str(value)]
    return run(*arguments)


def run(*arguments: str) -> dict[str, Any]:
    """Any command of the command line without a device, or on a simulated one of its own."""
    return _document(*_kmax.run_command(list(arguments)))


def check(parameters: Mapping[str, Setting] | None = None, *, hand: str = "none", axis: int = 0) -> Check:
    """As Device.check(), for the simulated device's parameters."""
    return _check(run, parameters, hand, axis)


def experiment(name: str, **options: Any) -> dict[str, Any]:
    """An experiment of the papers on simulated people, as 'kmax experiment' names them. The command line's
    options with underscores: experiment("jitter", touches=3)."""
    return _experiment(run, name, options)


def scenes() -> list[str]:
    """Names of the scenes that the library brings."""
    return _kmax.scene_names()


def run_scene(scene: str | os.PathLike[str], parameters: Mapping[str, Setting] | None = None) -> Scene:
    """Runs a scene, a TOML file or a supplied one, on a simulated device, much faster than real time. `parameters` in place of
    the scene's. The same scene gives the same numbers."""
    return Scene(**_kmax.run_scene(os.fspath(scene), _settings(parameters or {})))
