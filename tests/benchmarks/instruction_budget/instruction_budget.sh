#!/bin/sh
# Counts the executed instructions of the interrupt path's steps on an emulated Cortex-M4F, prints them beside their
# budgets, and fails when one is above its budget or when the results are not the bits that x86 gives:
#   instruction_budget.sh SOURCE_DIR ARM_GXX QEMU_SYSTEM_ARM
#
# With -icount shift=0 QEMU advances its clock by 1 ns per instruction, and timer 2 of its STM32F405 counts
# nanoseconds: the counts are exact and the same in every run, whatever the machine is doing besides.
set -eu
source_dir=$1
gxx=$2
qemu=$3
here=$source_dir/tests/benchmarks/instruction_budget
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# As the images are compiled, see CMakeLists.txt and board/stm32f405/toolchain.cmake.
flags="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -std=c++20 -fno-exceptions -fno-rtti -fno-threadsafe-statics
       -ffp-contract=off -fno-math-errno -ffunction-sections -DNDEBUG -I$source_dir"
# shellcheck disable=SC2086  # the flags are words
"$gxx" $flags -nostartfiles -nodefaultlibs -specs=nano.specs -T "$here/image.ld" \
  "$here/start.cpp" "$here/image.cpp" "$here/steps.cpp" -lm -lc -lgcc -o "$work/image.elf"
"$qemu" -M netduinoplus2 -icount shift=0,sleep=off -nographic -monitor none -serial none \
  -semihosting-config enable=on,target=native -kernel "$work/image.elf" 2>&1
