#!/bin/sh
# Compiles the interrupt path for the Cortex-M4F as the images do and fails if its machine code calls anything:
#   interrupt_path.sh SOURCE_DIR ARM_GXX ARM_NM BOARD...
#
# An undefined symbol of these objects is a call out of them: libm, the heap, exceptions, or the compiler's own
# run-time library, which does 64-bit division and everything in double in software. Allowed are the copies
# that the compiler makes of struct assignments (memcpy, memmove, memset and their AEABI names): their length is
# fixed when compiled. The check first shows on code that breaks each rule that it would find it.
set -eu
source_dir=$1
gxx=$2
nm=$3
shift 3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
flags="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -std=c++20 -fno-exceptions -fno-rtti
       -ffp-contract=off -fno-math-errno -I$source_dir"
allowed='^(memcpy|memmove|memset|__aeabi_mem(cpy|move|set|clr)[48]?)$'

# Names that the object calls and may not.
forbidden_in() { # object
  "$nm" -u "$1" | awk '{ print $NF }' | grep -Ev "$allowed" || true
}

check() { # what, source
  # shellcheck disable=SC2086  # the flags are words
  "$gxx" $flags -c "$2" -o "$work/object.o"
  found=$(forbidden_in "$work/object.o")
  if [ -n "$found" ]; then
    echo "$1 calls what the interrupt path may not:"
    echo "$found" | sed 's/^/  /'
    return 1
  fi
  echo "$1: nothing but copies of memory"
}

must_be_caught() { # what, body of a function
  printf '#include <cmath>\n#include <cstdint>\nextern "C" int probe(long long a, long long b, float f, double d) { %s }\n' \
    "$2" > "$work/probe.cpp"
  if check "$1" "$work/probe.cpp" > /dev/null; then
    echo "the check itself is broken: it does not see $1"
    exit 1
  fi
}
must_be_caught "a 64-bit division" 'return static_cast<int>(a / b);'
must_be_caught "a 64-bit remainder" 'return static_cast<int>(static_cast<unsigned long long>(a) % static_cast<unsigned long long>(b));'
must_be_caught "int64 to float" 'return static_cast<int>(static_cast<float>(a) * f);'
must_be_caught "float to int64" 'return static_cast<int>(static_cast<long long>(f) >> 32);'
must_be_caught "arithmetic in double" 'return static_cast<int>(d * 3.0);'
must_be_caught "float to double" 'return static_cast<double>(f) > d;'
must_be_caught "libm" 'return static_cast<int>(std::sin(f));'
must_be_caught "the heap" 'static char* volatile kept; kept = new char[8]; return kept[0];'

# The haptic loop alone, as a board other than ours would use it.
cat > "$work/haptic_loop.cpp" << 'END'
#include "control/haptic_loop.hpp"
using Loop = kmax::control::HapticLoop<float>;
Loop::Output haptic_tick(Loop& loop, const Loop::Coefficients& c, std::int64_t count, bool enabled, float external) {
  return loop.tick(c, count, enabled, external);
}
void haptic_reset(Loop& loop) { loop.reset(); }
END

failed=0
check "control/haptic_loop.hpp" "$work/haptic_loop.cpp" || failed=1
check "firmware/drive/motor_control_tick.cpp" "$source_dir/firmware/drive/motor_control_tick.cpp" || failed=1
# Those of motor_control_tick.cpp, which has just been looked at.
motor='^_ZNK?4kmax8firmware12MotorControl(6excite|12report_fault)E'
allowed="$allowed|$motor"
check "firmware/drive/axis.cpp" "$source_dir/firmware/drive/axis.cpp" || failed=1
# Those of axis.cpp, likewise.
axis='^_ZNK?4kmax8firmware4Axis(8ISR_(tick|fill)E|4tripE)'
allowed="$allowed|$axis"
for board in "$@"; do
  check "board/$board/drives_tick.cpp" "$source_dir/board/$board/drives_tick.cpp" || failed=1
done
exit $failed
