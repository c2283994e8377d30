"""The EDS and the DBC that kmax describe writes, as readers that were not written here take them, and against the
document of kmax describe --format json."""

import configparser
import os
import re
import subprocess
import unittest

from kmax_under_test import KMAX, kmax, kmax_json

BITS = {0x2: 8, 0x3: 16, 0x4: 32, 0x5: 8, 0x6: 16, 0x7: 32, 0x8: 32}
TYPES = {"integer8": 0x2, "integer16": 0x3, "integer32": 0x4, "unsigned8": 0x5, "unsigned16": 0x6,
         "unsigned32": 0x7, "float32": 0x8}


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
                self.assertEqual("ro" if entry["access"] == "ro" else "rw", section["AccessType"])
                self.assertEqual(entry["access"] != "ro", "DefaultValue" in section)
                if entry["access"] == "ro" or entry["values"]:
                    continue
                default = section["DefaultValue"]
                if default.startswith("$NODEID+"):
                    default = default.removeprefix("$NODEID+")
                number = float(default) if entry["type"] == "float32" else int(default, 0)
                self.assertEqual(entry["default"], number)

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
            for number in range(4):
                count = int(self.section(kind + number, 0)["DefaultValue"])
                for sub in range(1, count + 1):
                    mapping = int(self.section(kind + number, sub)["DefaultValue"], 16)
                    mapped = self.section(mapping >> 16, mapping >> 8 & 0xFF)
                    self.assertEqual("1", mapped["PDOMapping"])
                    self.assertEqual(mapping & 0xFF, BITS[int(mapped["DataType"], 16)])

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


class Dbc(unittest.TestCase):
    def test_signals_fill_their_messages(self):
        text = kmax("describe", "--format", "dbc", "--node", "9").stdout
        messages = {int(i): (name, int(size)) for i, name, size in re.findall(r"^BO_ (\d+) (\w+): (\d+) ", text, re.M)}
        self.assertEqual({0x80, 0x89, 0x189, 0x289, 0x389, 0x489, 0x209, 0x309, 0x709}, set(messages))
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


if __name__ == "__main__":
    unittest.main()
