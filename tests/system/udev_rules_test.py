"""The udev rules that are installed: each line is one, and which device gets what. Without udev, whose own check of rules
(udevadm verify) is younger than Debian 12."""

import fnmatch
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RULES = ROOT / "host_tools/package/60-kmax.rules"
PART = re.compile(r'([A-Z]+)(?:\{(\w+)\})?(==|!=|\+=|=)"([^"]*)"')
MATCHED, ASSIGNED = {"SUBSYSTEM", "ATTR", "ATTRS"}, {"TAG", "SYMLINK"}


def rules():
    """Each rule as (key, name, operator, value); ValueError for what is none."""
    for number, line in enumerate(RULES.read_text().splitlines(), 1):
        if not line or line.startswith("#"):
            continue
        parts = [PART.fullmatch(part) for part in re.split(r",\s*", line)]
        if not all(parts):
            raise ValueError(f"{RULES.name}:{number}: {line}")
        yield [part.groups() for part in parts]


def outcome(subsystem, properties, *chain):
    """What a device gets whose own attributes are chain[0], and those of its parents the others."""
    result = {"tags": set(), "links": set(), "properties": {}}

    def matches(key, name, value):
        if key == "SUBSYSTEM":
            return fnmatch.fnmatch(subsystem, value)
        if key == "ENV":
            return fnmatch.fnmatch(properties.get(name, ""), value)
        return fnmatch.fnmatch(chain[0].get(name, ""), value)

    for rule in rules():
        own = [(key, name, value) for key, name, operator, value in rule if operator == "==" and key != "ATTRS"]
        of_one = [(name, value) for key, name, operator, value in rule if key == "ATTRS"]
        # All ATTRS of a rule must be those of one and the same device of the chain.
        parent = next((one for one in chain if all(fnmatch.fnmatch(one.get(name, ""), value) for name, value in of_one)), None)
        if parent is None or not all(matches(*part) for part in own):
            continue
        for key, name, operator, value in rule:
            if operator == "==":
                continue
            value = re.sub(r"\$attr\{(\w+)\}", lambda found: chain[0].get(found[1]) or parent[found[1]], value)
            if key == "TAG":
                result["tags"].add(value)
            elif key == "SYMLINK":
                result["links"].add(value)
            else:
                result["properties"][name] = value
    return result


KMAX = {"idVendor": "1209", "idProduct": "2323", "manufacturer": "Kmax", "serial": "1F2E3D4C"}
USB = {"DEVTYPE": "usb_device"}


class Rules(unittest.TestCase):
    def test_every_line_is_a_rule_of_known_keys(self):
        found = list(rules())
        self.assertGreater(len(found), 5)
        for rule in found:
            for key, name, operator, _ in rule:
                allowed = MATCHED | {"ENV"} if operator == "==" else ASSIGNED | {"ENV"}
                self.assertIn(key, allowed, rule)
                self.assertEqual(name is not None, key in ("ATTR", "ATTRS", "ENV"), rule)
                if key in ("TAG", "SYMLINK"):
                    self.assertEqual(operator, "+=", rule)
            self.assertTrue(any(operator != "==" for *_, operator, _ in rule), rule)

    def test_the_tag_is_set_before_the_rules_that_act_on_it(self):
        self.assertLess(RULES.name, "73-seat-late.rules")
        self.assertLess(RULES.name, "77-mm-usb-device-blacklist.rules")

    def test_the_numbers_are_those_of_the_firmware_and_of_the_host_tools(self):
        descriptors = (ROOT / "firmware/usb/descriptors.hpp").read_text()
        identity = re.search(r"Identity identity\{0x(\w+), 0x(\w+)\};", descriptors)
        maker = re.search(r'case Text::maker:\s*return "(\w+)";', descriptors)
        self.assertEqual((identity[1].lower(), identity[2].lower(), maker[1]),
                         (KMAX["idVendor"], KMAX["idProduct"], KMAX["manufacturer"]))
        dfu = re.search(r"vendor == 0x(\w+) && product == 0x(\w+);", (ROOT / "host_tools/usb/usb_devices.hpp").read_text())
        bootloader = {"idVendor": dfu[1].lower(), "idProduct": dfu[2].lower()}
        self.assertEqual(outcome("usb", USB, bootloader)["tags"], {"uaccess"})

    def test_kmax_may_be_asked_for_its_bootloader(self):
        got = outcome("usb", USB, KMAX)
        self.assertEqual(got["tags"], {"uaccess"})
        self.assertEqual(got["properties"], {"ID_MM_DEVICE_IGNORE": "1"})
        self.assertEqual(got["links"], set())

    def test_its_interfaces_are_no_devices(self):
        self.assertEqual(outcome("usb", {"DEVTYPE": "usb_interface"}, {}, KMAX)["tags"], set())

    def test_its_serial_port_has_a_name_that_stays_and_is_no_modem(self):
        got = outcome("tty", {}, {}, {"bInterfaceNumber": "01"}, KMAX, {"idVendor": "1d6b", "serial": "vhci_hcd.0"})
        self.assertEqual(got, {"tags": {"uaccess"}, "links": {"kmax-1F2E3D4C"},
                               "properties": {"ID_MM_DEVICE_IGNORE": "1"}})

    def test_another_adapter_of_the_same_numbers_gets_nothing(self):
        other = KMAX | {"manufacturer": "bytewerk"}
        for got in outcome("usb", USB, other), outcome("tty", {}, {}, other):
            self.assertEqual(got, {"tags": set(), "links": set(), "properties": {}})

    def test_a_hub_above_does_not_lend_its_attributes(self):
        # Half of what a rule asks for in one device, half in its parent.
        got = outcome("tty", {}, {}, {"idVendor": "1209", "idProduct": "2323"}, {"manufacturer": "Kmax", "serial": "1"})
        self.assertEqual(got["links"], set())


if __name__ == "__main__":
    unittest.main()
