"""What an EDS promises of a node's frames: identifiers, lengths, and what is mapped where."""

import configparser
from typing import NamedTuple


class Mapped(NamedTuple):
    index: int
    subindex: int
    name: str
    bytes: int


class Pdo(NamedTuple):
    identifier: int
    event_time_ms: int
    mapped: tuple

    @property
    def length(self):
        return sum(entry.bytes for entry in self.mapped)

    def parts(self, data):
        """{name: bytes} of a frame."""
        found, at = {}, 0
        for entry in self.mapped:
            found[entry.name] = data[at:at + entry.bytes]
            at += entry.bytes
        return found


class PromisedFrames:
    def __init__(self, eds_text, node):
        self._eds = configparser.ConfigParser(interpolation=None)
        self._eds.read_string(eds_text)
        self._node = node
        # CiA 301's predefined connection set, where the EDS has no object for it.
        self.heartbeat = 0x700 + node
        self.sdo_request, self.sdo_reply = 0x600 + node, 0x580 + node
        self.emergency = self.default("1014") & 0x7FF
        self.tpdos = [self._pdo(number) for number in range(int(self._eds["DeviceInfo"]["NrOfTxPDO"]))]

    def default(self, section):
        text = self._eds[section]["DefaultValue"]
        if text.startswith("$NODEID+"):
            return int(text.removeprefix("$NODEID+"), 0) + self._node
        return int(text, 0)

    def _pdo(self, number):
        parameters, mapping = f"{0x1800 + number:04X}", f"{0x1A00 + number:04X}"
        mapped = []
        for entry in range(1, self.default(f"{mapping}sub0") + 1):
            value = self.default(f"{mapping}sub{entry}")
            index, subindex = value >> 16, value >> 8 & 0xFF
            name = f"{index:04X}"
            section = self._eds[f"{name}sub{subindex:X}" if f"{name}sub{subindex:X}" in self._eds else name]
            mapped.append(Mapped(index, subindex, section["ParameterName"], (value & 0xFF) // 8))
        return Pdo(self.default(f"{parameters}sub1") & 0x7FF, self.default(f"{parameters}sub5"), tuple(mapped))

    def lengths(self):
        """{identifier: bytes} of all that the node may send."""
        return {self.heartbeat: 1, self.sdo_reply: 8, self.emergency: 8,
                **{pdo.identifier: pdo.length for pdo in self.tpdos}}
