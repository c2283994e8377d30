"""The EDS and the DBC that kmax describe writes, as readers that were not written here take them, and against the
document of kmax describe --format json."""

import configparser
import importlib
import logging
import os
import re
import struct
import subprocess
import unittest
from datetime import datetime

from kmax_under_test import KMAX, kmax, kmax_json

BITS = {0x2: 8, 0x3: 16, 0x4: 32, 0x5: 8, 0x6: 16, 0x7: 32, 0x8: 32}
RANGES = {0x2: (-0x80, 0x7F), 0x3: (-0x8000, 0x7FFF), 0x4: (-0x80000000, 0x7FFFFFFF), 0x5: (0, 0xFF),
          0x6: (0, 0xFFFF), 0x7: (0, 0xFFFFFFFF)}
REAL32, DOMAIN = 0x8, 0xF
TYPES = {"integer8": 0x2, "integer16": 0x3, "integer32": 0x4, "unsigned8": 0x5, "unsigned16": 0x6,
         "unsigned32": 0x7, "float32": 0x8}


class Json(unittest.TestCase):
    def test_it_says_what_an_armed_axis_lets_change(self):
        objects = {entry["name"]: entry for entry in kmax_json("describe")["objects"]}
        for name, change, ceiling in (
                ("force.limit", "lower", "force.ceiling"), ("axis1.force.limit", "lower", "axis1.force.ceiling"),
                ("force.ceiling", "none", None), ("supply.voltage_min", "higher", None),
                ("interference.background_force", "nearer to 0", "force.ceiling"), ("wall.position", "none", None),
                ("interference.onset_time", "higher", None), ("excitation.bias", "any", None),
                ("wall.magnetic_length", "none", None), ("rpdo1.cob_id", "none", None), ("tpdo1.cob_id", "any", None),
                ("measured.force", None, None)):
            with self.subTest(name):
                self.assertEqual((change, ceiling), (objects[name]["change_while_armed"], objects[name]["ceiling"]))
        for name, only_commander in (("wall.stiffness", True), ("axis1.excitation.run", True), ("force.limit", False),
                                     ("trace.axis", False)):
            with self.subTest(name):
                self.assertEqual(only_commander, objects[name]["only_commander"])


class Eds(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.eds = configparser.ConfigParser(interpolation=None, strict=True)
        cls.eds.optionxform = str
        cls.eds.read_string(kmax("describe", "--format", "eds").stdout)
        cls.objects = kmax_json("describe")["objects"]

    def section(self, index, subindex):
        name = f"{index:04X}"
        if "SubNumber" in self.eds[name]:
            return self.eds[f"{name}sub{subindex:X}"]
        self.assertEqual(subindex, 0)
        return self.eds[name]

    def test_every_value_of_the_dictionary_is_described_alike(self):
        for entry in self.objects:
            with self.subTest(entry["name"]):
                section = self.section(entry["index"], entry["subindex"])
                self.assertEqual(entry["name"], section["ParameterName"])
                self.assertEqual(TYPES[entry["type"]], int(section["DataType"], 16))
                self.assertIn(section["AccessType"], ("ro",) if entry["access"] == "ro" else ("rw", "rwr", "rww"))
                self.assertEqual(entry["access"] != "ro" and entry["type"] != "float32", "DefaultValue" in section)
                if "DefaultValue" not in section or entry["values"]:
                    continue
                self.assertEqual(entry["default"], int(section["DefaultValue"].removeprefix("$NODEID+"), 0))

    def test_lists_and_sub_numbers_add_up(self):
        listed = []
        for title in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
            numbers = dict(self.eds[title])
            self.assertEqual(int(numbers.pop("SupportedObjects")), len(numbers))
            listed += [f"{int(index, 16):04X}" for index in numbers.values()]
        self.assertEqual(sorted(listed), [name for name in self.eds if re.fullmatch("[0-9A-F]{4}", name)])
        for name in listed:
            subs = [int(other[7:], 16) for other in self.eds if other.startswith(name + "sub")]
            self.assertEqual(int(self.eds[name].get("SubNumber", "0")), len(subs))
            if subs and self.eds[name + "sub0"]["AccessType"] == "const":
                self.assertEqual(int(self.eds[name + "sub0"]["DefaultValue"], 0), max(subs))

    def test_what_is_mapped_by_default_may_be_mapped(self):
        for kind in (0x1600, 0x1A00):
            for number in range(4 if kind == 0x1600 else 5):
                count = int(self.section(kind + number, 0)["DefaultValue"])
                for sub in range(1, count + 1):
                    mapping = int(self.section(kind + number, sub)["DefaultValue"], 16)
                    mapped = self.section(mapping >> 16, mapping >> 8 & 0xFF)
                    self.assertEqual("1", mapped["PDOMapping"])
                    self.assertIn(mapped["AccessType"], ("rw", "rww") if kind == 0x1600 else ("rw", "rwr", "ro"))
                    self.assertEqual(mapping & 0xFF, BITS[int(mapped["DataType"], 16)])

    def test_sdo_servers_and_sync(self):
        for index, subindex, default, access in (
                (0x1200, 1, "$NODEID+0x600", "ro"), (0x1200, 2, "$NODEID+0x580", "ro"), (0x1201, 1, "0x80000000", "rw"),
                (0x1201, 2, "0x80000000", "rw"), (0x1005, 0, "0x00000080", "rw"), (0x1006, 0, "0x00000000", "rw"),
                (0x1019, 0, "0", "rw")):
            section = self.section(index, subindex)
            self.assertEqual((default, access, "0"),
                             (section["DefaultValue"], section["AccessType"], section["PDOMapping"]), hex(index))
        for index in (0x1200, 0x1201):
            self.assertEqual("0x9", self.eds[f"{index:04X}"]["ObjectType"])
        for index in (0x60FD, 0x68FD):
            self.assertEqual(("ro", "1"), tuple(self.section(index, 0)[key] for key in ("AccessType", "PDOMapping")))

    def test_the_file_is_the_same_whenever_it_is_written(self):
        def eds(epoch):
            environment = {name: value for name, value in os.environ.items() if name != "SOURCE_DATE_EPOCH"}
            if epoch is not None:
                environment["SOURCE_DATE_EPOCH"] = epoch
            return subprocess.run([KMAX, "describe", "--format", "eds"], capture_output=True, text=True,
                                  env=environment, check=False)

        self.assertIn("\nCreationTime=12:00AM\nCreationDate=01-01-1970\n", eds(None).stdout)
        dated = eds("1700000000").stdout
        self.assertIn("\nCreationTime=10:13PM\nCreationDate=11-14-2023\n", dated)
        self.assertIn("\nModificationTime=10:13PM\nModificationDate=11-14-2023\n", dated)
        self.assertIn("\nCreationDate=12-31-9999\n", eds("253402300799").stdout)
        for wrong in ("", "today", "-1", "1.5", "253402300800", "99999999999999999999"):
            with self.subTest(wrong):
                done = eds(wrong)
                self.assertEqual((2, ""), (done.returncode, done.stdout))
                self.assertIn(f"SOURCE_DATE_EPOCH is '{wrong}'", done.stderr)


class StrictEds(unittest.TestCase):
    """What checkers of data sheets complain about, such as dcfchk of lely-core and CANchkEDS."""

    INFORMATION = {
        "FileInfo": "FileName FileVersion FileRevision EDSVersion Description CreationTime CreationDate CreatedBy "
                    "ModificationTime ModificationDate ModifiedBy",
        "DeviceInfo": "VendorName VendorNumber ProductName ProductNumber RevisionNumber OrderCode BaudRate_10 BaudRate_20 "
                      "BaudRate_50 BaudRate_125 BaudRate_250 BaudRate_500 BaudRate_800 BaudRate_1000 SimpleBootUpMaster "
                      "SimpleBootUpSlave Granularity DynamicChannelsSupported CompactPDO GroupMessaging NrOfRxPDO "
                      "NrOfTxPDO LSS_Supported"}
    LISTS = {"MandatoryObjects": lambda index: index in (0x1000, 0x1001, 0x1018),
             "OptionalObjects": lambda index: index < 0x2000 or 0x6000 <= index < 0xFFFF,
             "ManufacturerObjects": lambda index: 0x2000 <= index < 0x6000}
    OBJECT = "ParameterName ObjectType DataType AccessType DefaultValue LowLimit HighLimit PDOMapping"
    NUMBER = re.compile(r"(\$NODEID\+)?(0x[0-9A-F]+|0|-?[1-9][0-9]*)")  # a leading 0 would be octal
    LAST_NODE = 127

    @classmethod
    def setUpClass(cls):
        cls.text = kmax("describe", "--format", "eds").stdout
        # To many readers what differs in case only is the same.
        configparser.ConfigParser(interpolation=None, strict=True).read_string(cls.text.lower())
        cls.eds = configparser.ConfigParser(interpolation=None, strict=True)
        cls.eds.optionxform = str
        cls.eds.read_string(cls.text)
        cls.variables = {name: section for name, section in cls.eds.items()
                         if re.fullmatch("[0-9A-F]{4}(sub(0|[1-9A-F][0-9A-F]?))?", name)
                         and section.get("ObjectType") in ("0x7", "0x2")}

    def number(self, text, node=0):
        match = self.NUMBER.fullmatch(text)
        self.assertTrue(match, f"{text!r} is no number")
        return int(match[2], 0) + (node if match[1] else 0)

    def test_lines_are_short_and_plain(self):
        for line in self.text.splitlines():
            self.assertTrue(line.isascii() and line == line.strip(), line)
            self.assertLess(len(line), 255, line)
            self.assertFalse(";" in line or "#" in line, line)  # comments to some readers
            self.assertRegex(line, r"^$|^\[\w+\]$|^\w+=.")

    def test_information(self):
        for title, keys in self.INFORMATION.items():
            self.assertEqual(set(keys.split()), set(self.eds[title]))
        for what in ("Creation", "Modification"):
            stamp = self.eds["FileInfo"][f"{what}Date"] + " " + self.eds["FileInfo"][f"{what}Time"]
            datetime.strptime(stamp, "%m-%d-%Y %I:%M%p")
        device = self.eds["DeviceInfo"]
        for key in device:
            if key not in ("VendorName", "ProductName", "OrderCode"):
                self.number(device[key])
        for key, kind in (("NrOfRxPDO", 0x1400), ("NrOfTxPDO", 0x1800)):
            for index in (kind, kind + 0x200):
                there = [name for name in self.eds if re.fullmatch(f"{index >> 8:X}[0-9A-F]{{2}}", name)]
                self.assertEqual(int(device[key]), len(there))
        dummies = self.eds["DummyUsage"]
        self.assertEqual([f"Dummy{number:04X}" for number in range(1, 8)], list(dummies))
        for key, allowed in dummies.items():
            bits = {1: 1, **BITS}[int(key[5:], 16)]
            self.assertTrue(allowed == "0" or allowed == "1" and bits >= int(device["Granularity"]), key)
        self.assertEqual(["Lines"] + [f"Line{1 + i}" for i in range(int(self.eds["Comments"]["Lines"]))],
                         list(self.eds["Comments"]))

    def test_sections(self):
        known = {"DEFAULT", "DummyUsage", "Comments", *self.INFORMATION, *self.LISTS}
        for title, belongs in self.LISTS.items():
            for key, index in self.eds[title].items():
                if key != "SupportedObjects":
                    self.assertTrue(belongs(int(index, 16)), f"{title}: {index}")
                    known.add(f"{int(index, 16):04X}")
        for name, section in self.eds.items():
            if name in known:
                continue
            self.assertIn(name, self.variables)
            self.assertIn(name[:4], known)
            self.assertIn("SubNumber", self.eds[name[:4]])
        for name in known - {"DEFAULT", "DummyUsage", "Comments", *self.INFORMATION, *self.LISTS}:
            section = self.eds[name]
            if "SubNumber" not in section:
                continue
            self.assertEqual({"ParameterName", "ObjectType", "SubNumber"}, set(section), name)
            self.assertIn(section["ObjectType"], ("0x8", "0x9"), name)
            self.assertEqual("0x0005", self.eds[f"{name}sub0"]["DataType"], name)
            types = {self.eds[other]["DataType"] for other in self.variables if re.fullmatch(f"{name}sub[^0].*", other)}
            self.assertTrue(section["ObjectType"] == "0x9" or len(types) == 1, name)

    def test_variables(self):
        self.assertGreater(len(self.variables), 600)
        for name, section in self.variables.items():
            with self.subTest(name):
                self.assertLessEqual(set(section), set(self.OBJECT.split()))
                self.assertTrue(0 < len(section["ParameterName"]) <= 241)
                kind = int(section["DataType"], 16)
                self.assertEqual(section["ObjectType"] == "0x2", kind == DOMAIN)
                self.assertIn(section["AccessType"], ("const", "ro", "wo", "rw", "rwr", "rww"))
                mapping = section.get("PDOMapping", "0")
                self.assertIn(mapping, ("0", "1"))
                self.assertTrue(mapping == "0" or kind in BITS)
                self.assertTrue(mapping == "1" or section["AccessType"] not in ("rwr", "rww"))
                numbers = [section[key] for key in ("LowLimit", "DefaultValue", "HighLimit") if key in section]
                if kind in RANGES:
                    low, high = RANGES[kind]
                    for node in (1, self.LAST_NODE):
                        ascending = [low, *(self.number(text, node) for text in numbers), high]
                        self.assertEqual(sorted(ascending), ascending)
                else:
                    # Some read a REAL32 as a decimal, others as the pattern of its bits; a text has no quotes.
                    self.assertEqual([], numbers)


class Dbc(unittest.TestCase):
    def test_signals_fill_their_messages(self):
        text = kmax("describe", "--format", "dbc", "--node", "9").stdout
        messages = {int(i): (name, int(size)) for i, name, size in re.findall(r"^BO_ (\d+) (\w+): (\d+) ", text, re.M)}
        self.assertEqual({0x80, 0x89, 0x189, 0x289, 0x389, 0x489, 0x509, 0x209, 0x309, 0x709}, set(messages))
        for block in text.split("\n\n"):
            head = re.match(r"BO_ (\d+) (\w+): (\d+) ", block)
            if not head:
                continue
            used = set()
            for start, length in re.findall(r"SG_ \w+ : (\d+)\|(\d+)@1[+-]", block):
                bits = set(range(int(start), int(start) + int(length)))
                self.assertFalse(used & bits, head[2])
                used |= bits
            self.assertLessEqual(max(used, default=-1), 8 * int(head[3]) - 1)
            if "PDO" in head[2]:
                self.assertEqual(len(used), 8 * int(head[3]))

    def test_a_reader_that_was_not_written_here_decodes_what_the_device_sends(self):
        logging.getLogger("canmatrix").setLevel(logging.CRITICAL)  # which other formats it cannot read
        formats = importlib.import_module("canmatrix.formats")
        text = kmax("describe", "--format", "dbc", "--node", "9").stdout
        matrix = formats.loads_flat(text, "dbc")
        frames = {frame.name: frame for frame in matrix.frames}
        self.assertEqual(10, len(frames))

        def decoded(name, layout, *values):
            signals = frames[name].decode(struct.pack(layout, *values))
            return {signal: (value.raw_value, str(value.named_value)) for signal, value in signals.items()}

        # An axis trips: error code, error register, axis, and the number that tripped it.
        trip = decoded("EMERGENCY", "<HBBf", 0x2310, 3, 1, 12.5)
        self.assertEqual((0x2310, "over_current"), trip["error_code"])
        self.assertEqual((1, "axis1"), trip["place"])
        self.assertEqual(12.5, trip["detail"][0])
        self.assertEqual((0x8120, "error_passive"), decoded("EMERGENCY", "<HBBf", 0x8120, 17, 127, 0)["error_code"])
        self.assertEqual("none", decoded("EMERGENCY", "<HBBf", 0, 0, 0, 0)["error_code"][1])
        telemetry = decoded("TPDO1", "<if", -5, 1.5)
        self.assertEqual((-5, 1.5), tuple(raw for raw, _ in telemetry.values()))
        states = decoded("TPDO5", "<HbHb", 0x0237, 10, 0x0250, -1)
        self.assertEqual([(0x237, 10), (0x250, -1)], [tuple(states[f"axis{axis}_{name}"][0] for name in (
            "drive_statusword", "operation_mode_display")) for axis in range(2)])
        self.assertEqual("cyclic_synchronous_torque", states["axis0_operation_mode_display"][1])
        self.assertEqual("haptic", states["axis1_operation_mode_display"][1])
        self.assertEqual((5, "operational"), decoded("HEARTBEAT", "<B", 5)["nmt_state"])


if __name__ == "__main__":
    unittest.main()
