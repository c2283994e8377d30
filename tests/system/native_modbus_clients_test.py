"""mbpoll and pymodbus, neither written here, against the native firmware behind a pseudo-terminal."""

import struct
import sys
import unittest

from pymodbus.client import ModbusSerialClient
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.mei_message import ReadDeviceInformationRequest
from pymodbus.register_read_message import ReadWriteMultipleRegistersRequest
from pymodbus.register_write_message import MaskWriteRegisterRequest

from kmax_under_test import Serve, kmax, kmax_json, registers
from mbpoll_session import mbpoll


def words_of(number):
    return list(struct.unpack(">HH", struct.pack(">f", number)))


def number_of(words):
    return struct.unpack(">f", struct.pack(">HH", *words))[0]


class Mbpoll(unittest.TestCase):
    def test_reads_and_writes_what_kmax_shows(self):
        with Serve() as board:
            places = registers()
            stiffness = places["wall.stiffness"]["address"]
            self.assertEqual(mbpoll(board.link, "holding", stiffness), [1000.0])
            mbpoll(board.link, "holding", stiffness, values=[3580])
            self.assertEqual(kmax_json("get", "wall.stiffness", device=board.device)["wall.stiffness"]["value"], 3580)
            kmax("set", "wall.stiffness=8410", device=board.device)
            self.assertEqual(mbpoll(board.link, "holding", stiffness), [8410.0])

    def test_reads_a_whole_group_and_the_second_axis(self):
        with Serve() as board:
            places = registers()
            first = places["axis1.wall.stiffness"]["address"]
            values = mbpoll(board.link, "holding", first, count=4)
            self.assertEqual(values[0], 1000.0)
            self.assertAlmostEqual(values[3], 0.001, 9)

    def test_is_told_what_is_not_allowed(self):
        with Serve() as board:
            stiffness = registers()["wall.stiffness"]["address"]
            with self.assertRaisesRegex(AssertionError, "Illegal data value"):
                mbpoll(board.link, "holding", stiffness, values=[2e6])
            with self.assertRaisesRegex(AssertionError, "Illegal data address"):
                mbpoll(board.link, "holding", 0x7000)
            self.assertEqual(mbpoll(board.link, "holding", stiffness), [1000.0])


class Pymodbus(unittest.TestCase):
    def setUp(self):
        self.board = Serve().__enter__()
        self.places = registers()
        # A pseudo-terminal has no parity: the kernel refuses to set it.
        self.client = ModbusSerialClient(str(self.board.link), framer=ModbusRtuFramer, baudrate=115200, bytesize=8,
                                         parity="N", stopbits=1, timeout=20)
        self.assertTrue(self.client.connect())

    def tearDown(self):
        self.client.close()
        self.board.__exit__()

    def address(self, name):
        return self.places[name]["address"]

    def test_function_3_4_6_and_16(self):
        law, stiffness = self.address("wall.law"), self.address("wall.stiffness")
        self.assertFalse(self.client.write_register(law, 2, slave=1).isError())
        self.assertEqual(self.client.read_holding_registers(law, 1, slave=1).registers, [2])
        self.assertFalse(self.client.write_registers(stiffness, words_of(5500.0), slave=1).isError())
        self.assertEqual(number_of(self.client.read_holding_registers(stiffness, 2, slave=1).registers), 5500.0)
        checksum = self.client.read_input_registers(self.address("info.dictionary_checksum"), 2, slave=1).registers
        shown = kmax_json("describe", "--format", "json")
        self.assertNotEqual(checksum, [0, 0])
        self.assertTrue(shown["objects"])

    def test_function_22_changes_only_the_masked_bits(self):
        law = self.address("wall.law")
        self.client.write_register(law, 1, slave=1)
        request = MaskWriteRegisterRequest(law, 0xFFFD, 0x0002, unit=1)
        request.unit_id = request.slave_id = 1
        self.assertFalse(self.client.execute(request).isError())
        self.assertEqual(self.client.read_holding_registers(law, 1, slave=1).registers, [3])

    def test_function_23_writes_before_it_reads(self):
        stiffness = self.address("wall.stiffness")
        request = ReadWriteMultipleRegistersRequest(read_address=stiffness, read_count=2, write_address=stiffness,
                                                    write_registers=words_of(4321.0), unit=1)
        request.unit_id = request.slave_id = 1
        reply = self.client.execute(request)
        self.assertFalse(reply.isError())
        self.assertEqual(number_of(reply.registers), 4321.0)

    def test_function_43_14_names_the_device(self):
        request = ReadDeviceInformationRequest(read_code=1, object_id=0, unit=1)
        request.unit_id = request.slave_id = 1
        reply = self.client.execute(request)
        self.assertFalse(reply.isError())
        self.assertEqual(reply.information[0], b"Kmax")

    def test_half_a_value_is_refused_and_nothing_changes(self):
        stiffness = self.address("wall.stiffness")
        for start, words in ((stiffness, [0]), (stiffness + 1, [0]), (stiffness + 1, [0, 0])):
            reply = self.client.write_registers(start, words, slave=1)
            self.assertTrue(reply.isError())
            self.assertEqual(reply.exception_code, 2)
        self.assertEqual(number_of(self.client.read_holding_registers(stiffness, 2, slave=1).registers), 1000.0)

    def test_one_bad_value_among_many_changes_none(self):
        stiffness = self.address("wall.stiffness")
        before = self.client.read_holding_registers(stiffness, 8, slave=1).registers
        reply = self.client.write_registers(stiffness, words_of(1.0) + words_of(2.0) + words_of(-5.0) + words_of(0.5),
                                            slave=1)
        self.assertTrue(reply.isError())
        self.assertEqual(reply.exception_code, 3)
        self.assertEqual(self.client.read_holding_registers(stiffness, 8, slave=1).registers, before)


if __name__ == "__main__":
    sys.exit(unittest.main())
