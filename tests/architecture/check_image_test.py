"""What a flashed image must not hold or do is refused by the check after linking, board/stm32f405/check_image.cmake.

usage: tests/architecture/check_image_test.py [-v] [TEST...]          as unittest has it

Each test links a made-up image of a few instructions and reads what the check says of it.
"""

import subprocess
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).resolve().parents[2] / "board" / "stm32f405" / "check_image.cmake"
HANDLER = ".globl ISR_adc\n.type ISR_adc, %function\nISR_adc:\n"
FLASH, PARAMETERS = 0x0800_C000, 0x0800_7000


def said_of(code, text_at=FLASH, handlers="ISR_adc", in_sram="", sections=()):
    """The problems, none of a fit image; one that is refused is removed."""
    with tempfile.TemporaryDirectory() as folder:
        source, made, image = (str(Path(folder) / name) for name in ("made_up.s", "made_up.o", "made_up.elf"))
        Path(source).write_text(".syntax unified\n.thumb\n.text\n" + code)
        subprocess.run(["arm-none-eabi-as", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", source, "-o", made], check=True)
        subprocess.run(["arm-none-eabi-ld", f"-Ttext={text_at:#x}", "-e0",
                        *(f"--section-start={name}={at:#x}" for name, at in sections), made, "-o", image], check=True)
        tools = {name.upper(): f"arm-none-eabi-{name}" for name in ("nm", "readelf", "objdump")}
        done = subprocess.run(["cmake", *(f"-D{name}={value}" for name, value in {**tools, "ELF": image}.items()),
                               f"-DHANDLERS={handlers}", f"-DIN_SRAM={in_sram}", "-P", str(CHECK)],
                              capture_output=True, text=True, check=False)
        assert (done.returncode != 0) == ("is not fit for the target" in done.stderr) == (not Path(image).exists()), done
        return {line.strip() for line in done.stderr.partition("target:")[2].splitlines() if line.strip()}


def with_functions(names):
    return HANDLER + "bx lr\n" + "".join(f'.globl "{name}"\n.thumb_func\n"{name}": bx lr\n' for name in names)


class CheckImage(unittest.TestCase):
    def refused(self, names, why):
        said = said_of(with_functions(names.split()))
        self.assertEqual({f"{name}: {why}" for name in names.split()}, said)

    def test_a_fit_image(self):
        # What the image has, and what only looks like something that it must not have.
        self.assertEqual(set(), said_of(with_functions("""main memcpy memset memmove __aeabi_ldivmod __aeabi_dadd
            _ZN4kmax4freeEv _ZN4kmax3sinEf free_slots exit_code _ZSt3minv abort_for printf_like""".split())))

    def test_heap(self):
        self.refused("""malloc free calloc realloc memalign aligned_alloc posix_memalign strdup _malloc_r _free_r _calloc_r
            _realloc_r _memalign_r _strdup_r sbrk _sbrk _sbrk_r _Znwj _Znaj _ZnwjRKSt9nothrow_t _ZnwjSt11align_val_t _ZdlPv
            _ZdlPvj _ZdaPv _ZdaPvj""", "heap, exception or process support")

    def test_exceptions(self):
        self.refused("""__cxa_throw __cxa_rethrow __cxa_allocate_exception __cxa_begin_catch __cxa_end_catch
            __cxa_end_cleanup __cxa_call_unexpected _Unwind_Resume _Unwind_RaiseException __gnu_unwind_frame
            __gxx_personality_v0 __aeabi_unwind_cpp_pr0 __aeabi_unwind_cpp_pr1 __aeabi_unwind_cpp_pr2 _ZSt9terminatev
            _ZSt13set_terminatePFvvE _ZN10__cxxabiv111__terminateEPFvvE _ZN9__gnu_cxx27__verbose_terminate_handlerEv
            _ZSt17__throw_bad_allocv _ZSt20__throw_length_errorPKc _ZSt25__throw_bad_function_callv
            _ZSt19uncaught_exceptionsv""", "heap, exception or process support")

    def test_process(self):
        self.refused("""abort exit _exit _Exit atexit __aeabi_atexit __cxa_atexit __register_exitproc raise __assert_func
            printf _printf_r snprintf sprintf vsnprintf _vfprintf_r _vfiprintf_r _svfprintf_r iprintf puts
            __cxa_guard_acquire __cxa_pure_virtual""", "heap, exception or process support")

    def test_virtual_functions_and_types(self):
        self.refused("""_ZTV1A _ZTT1A _ZTC1A0_1B _ZTI1A _ZTS1A __dynamic_cast _ZN10__cxxabiv117__class_type_infoD0Ev""",
                     "virtual function table or type information")

    def test_libm(self):
        self.refused("sinf cos sqrtf powf fmod atan2f floorf lround __ieee754_sqrtf __kernel_cosf", "libm")

    def test_unwind_tables(self):
        for section in (".ARM.exidx", ".ARM.extab", ".eh_frame", ".eh_frame_hdr", ".gcc_except_table"):
            with self.subTest(section):
                made = HANDLER + f'bx lr\n.section {section}, "a"\n.word 0, 0\n'
                self.assertEqual({f"{section}: table for unwinding the stack"}, said_of(made))

    def test_handlers(self):
        missing = "ISR_exti2: the board's handler is not in the vector table (misspelt, or vectors.hpp not included)"
        self.assertIn(missing, said_of(with_functions([]), handlers="ISR_adc,ISR_exti2"))
        default = with_functions([]) + ".weak ISR_exti2\n.thumb_func\nISR_exti2: bx lr\n"
        self.assertEqual({missing}, said_of(default, handlers="ISR_adc,ISR_exti2"))

    def test_slow_arithmetic_in_interrupts(self):
        for name in ("__aeabi_ldivmod", "__aeabi_l2f", "__aeabi_dadd", "__aeabi_f2d", "__udivmoddi4"):
            with self.subTest(name):
                made = with_functions(["f", name]).replace("bx lr", "bl f", 1).replace("bx lr", f"b {name}", 1)
                self.assertEqual({f"{name}: reached from an interrupt by way of f"}, said_of(made))

    def test_code_in_flash_behind_code_in_sram(self):
        far = ('.section .tick, "ax"\n.globl f\n.thumb_func\nf: bl g\nbx lr\n'
               ".text\n.globl g\n.type g, %function\n.thumb_func\ng: bx lr\n")
        near = '.section .tick, "ax"\n' + HANDLER + ".thumb_func\nbl f\nbx lr\n"
        why = "called by what runs from SRAM, but lies in flash (add it to tick_code.ld)"
        at = (".tick", 0x4000),
        self.assertEqual({f"g: {why}"}, said_of(near + far, in_sram="ISR_adc", sections=at))  # by way of a veneer
        self.assertEqual(set(), said_of(near + far.replace("f: bl g\n", "f: "), in_sram="ISR_adc", sections=at))
        self.assertEqual({"f: runs from SRAM and calls through a pointer, which may lead to flash"},
                         said_of(near + far.replace("f: bl g", "f: blx r3"), in_sram="ISR_adc", sections=at))
        self.assertEqual({f"ISR_adc: {why}"}, said_of(with_functions([]), in_sram="ISR_adc"))

    def test_parameter_sectors(self):
        said = said_of(with_functions([]), text_at=PARAMETERS)
        self.assertTrue(any("covers the parameter sectors" in problem for problem in said), said)


if __name__ == "__main__":
    unittest.main()
