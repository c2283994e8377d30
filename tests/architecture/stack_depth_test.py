"""stack_depth.py finds what it is for, in made-up disassemblies.

usage: tests/architecture/stack_depth_test.py [-v] [TEST...]          as unittest has it
"""

import re
import unittest

from machine_code import functions_in
from stack_depth import EXCEPTION_FRAME, Stated, examined, priorities_in

MINIMUM = {
    "ISR_reset": ["push {r3, lr}", "bl main"],
    "ISR_hard_fault": ["mrs r0, msp", "b.n ISR_unexpected"],
    "ISR_unexpected": ["push {r3, lr}", "bl stop", "nop"],
    "stop": ["udf #0"],
    "main": ["push {r4, r5, lr}", "sub sp, #20", "bl leaf", "wfi", "b.n main+8"],
    "leaf": ["bx lr"],
    "ISR_adc": ["push {r4, lr}", "vpush {d8-d9}", "bl leaf", "vpop {d8-d9}", "pop {r4, pc}"],
    "ISR_usart2": ["push {lr}", "pop {pc}"],
    "ISR_can1_tx": ["push {r0, r1, lr}", "bl leaf", "pop {r1, r2, pc}"],
}
PRIORITIES = {"adc": 1, "usart2": 8, "can1_tx": 8}
# Main loop, the deeper one of priority 8, priority 1, fault.
MINIMUM_BYTES = [8 + 12 + 20, 12 + EXCEPTION_FRAME, 8 + 16 + EXCEPTION_FRAME, 8 + EXCEPTION_FRAME]


def result(changed=None, stated=None, data=(), priorities=None, reserved=4096):
    """Of the minimum with other functions, in their order: each instruction 4 bytes, labels as FUNCTION or FUNCTION+OFFSET."""
    functions = {**MINIMUM, **(changed or {})}
    places, address = {}, 0x0800_0000
    for name, instructions in functions.items():
        places[name] = address
        address += 4 * len(instructions)

    def line(at, text):
        mnemonic, _, operands = text.partition(" ")
        label = re.search(r"(?<![\w{])(" + "|".join(map(re.escape, functions)) + r")(?:\+(\d+))?$", operands)
        if label and mnemonic == ".word":
            operands = hex(places[label[1]] + 1)
        elif label:
            operands = operands[:label.start()] + f"{places[label[1]] + int(label[2] or 0):x} <{label[0]}>"
        return f" {at:x}:\t{mnemonic}\t{operands}"

    lines = [(name, name, [line(places[name] + 4 * index, text) for index, text in enumerate(instructions)])
             for name, instructions in functions.items()]
    vectors = [0x2000_1000, *(place + 1 for name, place in places.items() if name.startswith("ISR_"))]
    return examined(lines, stated or Stated(), vectors, [places[name] + 1 for name in data], priorities or PRIORITIES, reserved)


class StackDepth(unittest.TestCase):
    def bytes_of(self, *arguments, **named):
        levels, problems = result(*arguments, **named)
        self.assertEqual([], problems)
        return [level.bytes for level in levels]

    def main_loop(self, *arguments, **named):
        """Of `main` and what it calls."""
        return self.bytes_of(*arguments, **named)[0] - 8

    def fails(self, *words, **named):
        levels, problems = result(**named)
        self.assertEqual(1, len(problems), problems)
        for word in words:
            self.assertIn(word, problems[0])

    def test_adds_up_the_deepest_of_each_priority(self):
        self.assertEqual(MINIMUM_BYTES, self.bytes_of())

    def test_reservation(self):
        self.bytes_of(reserved=sum(MINIMUM_BYTES))
        self.fails(f"{sum(MINIMUM_BYTES)} bytes", reserved=sum(MINIMUM_BYTES) - 1)

    def test_follows_a_jump_that_is_too_far_for_the_instruction(self):
        made = "\n\n".join(["08000000 <main>:\n 8000000:\tbl\t8000010 <__leaf_veneer>\n 8000004:\tbx\tlr",
                            "08000010 <__leaf_veneer>:\n 8000010:\tldr.w\tpc, [pc]\t@ 8000014 <__leaf_veneer+0x4>\n"
                            " 8000014:\t.word\t0x00004bc5", "00004bc4 <leaf>:\n    4bc4:\tbx\tlr"])
        listed = dict(functions_in(made))
        self.assertEqual(listed["__leaf_veneer"], [" 8000010:\tb.w\t4bc4 <leaf>"])
        self.assertEqual(listed["leaf"], ["    4bc4:\tbx\tlr"])

    def test_does_not_run_on_through_what_fills_up_to_the_next_function(self):
        for filling in (["nop"], ["movs r0, r0"], ["nop", "movs r0, r0"]):
            with self.subTest(filling):
                self.assertEqual(MINIMUM_BYTES, self.bytes_of({"leaf": ["bx lr", *filling]}))

    def test_everything_that_moves_the_stack_pointer(self):
        for instruction, size in [("push {r0-r3, sl, lr}", 24), ("stmdb sp!, {r4, r5, ip}", 12), ("vpush {s16}", 4),
                                  ("vstmdb sp!, {d8-d10}", 24), ("subw sp, sp, #1032", 1032), ("sub.w sp, sp, #2048", 2048),
                                  ("str.w lr, [sp, #-4]!", 4), ("strd r4, r5, [sp, #-16]!", 16), ("stmia.w sp, {r0, r1}", 0),
                                  ("add r0, sp, #8", 0), ("cmp sp, r3", 0), ("pushne {r4, r5}", 8), ("subeq sp, #8", 8)]:
            with self.subTest(instruction):
                self.assertEqual(size, self.main_loop({"main": [instruction, "bl leaf", "bx lr"]}))

    def test_what_is_given_back_before_a_call(self):
        for instruction in ["pop {r4, r5}", "ldmia.w sp!, {r4, r5}", "add sp, #8", "ldrd r4, r5, [sp], #8", "vpop {d8}"]:
            with self.subTest(instruction):
                main = ["push {r4, r5}", instruction, "b.w deep"]
                self.assertEqual(40, self.main_loop({"main": main, "deep": ["sub sp, #40", "add sp, #40", "bx lr"]}))
        # It may not have been given back.
        main = ["push {r4, r5}", "popne {r4, r5, pc}", "bl deep", "pop {r4, r5, pc}"]
        self.assertEqual(48, self.main_loop({"main": main, "deep": ["sub sp, #40", "add sp, #40", "bx lr"]}))

    def test_the_deeper_way_where_ways_meet(self):
        main = ["cbz r0, main+12", "push {r4, r5}", "b.n main+16", "push {r4, r5, r6, r7}", "bl leaf", "bx lr"]
        self.assertEqual(16, self.main_loop({"main": main}))

    def test_what_only_a_switch_reaches(self):
        main = ["push {r4, lr}", "tbb [pc, r3]", ".word 0x1", "bl deep", "pop {r4, pc}"]
        self.assertEqual(24, self.main_loop({"main": main, "deep": ["sub sp, #16", "add sp, #16", "bx lr"]}))
        main = ["push {r4, lr}", "ldr.w pc, [r3, r2, lsl #2]", ".word 0x1", "bl deep", "pop {r4, pc}"]
        self.assertEqual(24, self.main_loop({"main": main, "deep": ["sub sp, #16", "add sp, #16", "bx lr"]}))

    def test_falls_into_the_next_function(self):
        self.assertEqual(32, self.main_loop({"main": ["b.n first"], "first": ["eor r0, r1"],
                                             "second": ["sub sp, #32", "add sp, #32", "bx lr"]}))

    def test_recursion(self):
        again = ["push {r4, lr}", "bl again", "pop {r4, pc}"]
        self.fails("again: calls itself", changed={"main": ["bl again", "bx lr"], "again": again})
        self.assertEqual(3 * 8, self.main_loop({"main": ["bl again", "bx lr"], "again": again},
                                               Stated(entered_again={"again": 2})))
        # By way of another one, of which the bound is not stated.
        by_way = {"main": ["bl one", "bx lr"], "one": ["push {lr}", "bl other", "pop {pc}"],
                  "other": ["push {r4, lr}", "b.w one"]}
        self.fails("calls itself", changed=by_way)
        self.assertEqual(2 * (4 + 8), self.main_loop(by_way, Stated(entered_again={"one": 1})))
        self.fails("gone: stated, but not in the image", stated=Stated(entered_again={"gone": 1}))

    def test_stack_by_numbers_that_are_not_constant(self):
        for instruction in ["sub.w sp, sp, r3", "mov sp, r7", "subs.w sp, r3, #8", "msr msp, r2", "ldr.w sp, [r0]",
                            "and.w sp, sp, r1", "ldmdb.w sp!, {r0}"]:
            with self.subTest(instruction):
                changed = {"main": ["push {r4, lr}", instruction, "bl leaf", "b.n main+8"]}
                self.fails("main", "not constant", changed=changed)
                self.bytes_of(changed, Stated(sets_stack_pointer={"main"}))

    def test_stack_that_grows_in_a_loop(self):
        self.fails("main", "in a loop", changed={"main": ["push {r4}", "bl leaf", "b.n main"]}, reserved=1 << 20)

    def test_calls_through_pointers(self):
        called = {"target": ["sub sp, #64", "add sp, #64", "bx lr"]}
        for instruction in ["blx r3", "bx r3", "mov pc, r3", "ldr.w pc, [r3, #4]", "blxne ip"]:
            with self.subTest(instruction):
                changed = {"main": ["push {r4, lr}", instruction, "bl leaf", "b.n main+8"], **called}
                self.fails("main", "through a pointer", changed=changed)
                self.assertEqual(8 + 64, self.main_loop(changed, Stated(indirect={"main": ["target"]}), data=["target"]))
        self.fails("does not", stated=Stated(indirect={"main": ["leaf"]}))
        changed = {"main": ["blx r3", "b.n main"]}
        self.fails("gone, which is not in the image", changed=changed, stated=Stated(indirect={"main": ["gone"]}))

    def test_addresses_that_are_taken(self):
        self.fails("leaf: its address is taken", data=["leaf"])
        self.fails("leaf: its address is taken", changed={"other": ["bx lr", ".word leaf"]})

    def test_priorities(self):
        self.fails("ISR_can1_tx", "priorit", priorities={"adc": 1, "usart2": 8})
        self.assertEqual({"adc": 1, "exti2": 0, "system_tick": 4}, priorities_in("""
            inline constexpr std::uint8_t lines = 0;
            inline constexpr std::uint8_t tick = 1;
            inline constexpr std::uint8_t clock = 4;
            of = {OfInterrupt{Interrupt::exti2, lines}, OfInterrupt{Interrupt::adc, tick}};
            interrupts.set_priority(drivers::cortex_m::SystemException::system_tick, clock);"""))


if __name__ == "__main__":
    unittest.main()
