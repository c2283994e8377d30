// From the reset vector to main. PM0214 (FPU enabling, VTOR).

#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "drivers/cortex_m/startup.hpp"
#include "drivers/cortex_m/vectors.hpp"

int main();

extern "C" {
extern const std::uint32_t kmax_vectors[];
extern const std::uint32_t kmax_tick_code_image[];
extern std::uint32_t kmax_tick_code_stored[];
extern std::uint32_t kmax_tick_code_stored_end[];
extern std::uint32_t kmax_data_begin[];
extern std::uint32_t kmax_data_end[];
extern const std::uint32_t kmax_data_image[];
extern std::uint32_t kmax_bss_begin[];
extern std::uint32_t kmax_bss_end[];
extern std::uint32_t kmax_ccm_begin[];
extern std::uint32_t kmax_ccm_end[];
using Constructor = void (*)();
extern const Constructor kmax_constructors_begin[];
extern const Constructor kmax_constructors_end[];
}

namespace kmax::drivers::cortex_m {

namespace {

/// Where a symbol of the linker lies. The compiler takes two of them for two objects, whose places always
/// differ; an empty section has two at one place.
template <typename Word>
[[gnu::always_inline]] inline Word* place(Word* symbol) {
#if defined(__arm__)
  asm("" : "+r"(symbol));
#endif
  return symbol;
}
[[gnu::always_inline]] inline void copy(const std::uint32_t* from, std::uint32_t* begin, std::uint32_t* end) {
  end = place(end);
  for (begin = place(begin); begin != end; ++begin) *begin = *from++;
}
[[gnu::always_inline]] inline void clear(std::uint32_t* begin, std::uint32_t* end) {
  end = place(end);
  for (begin = place(begin); begin != end; ++begin) *begin = 0;
}

/// The compiler may use FPU registers for anything, moving memory included, so all that follows the enabling
/// lives in a function of its own.
[[noreturn, gnu::noinline, gnu::section(".boot.start")]] void start() {
  // First: what the compiler makes of the loops below may call functions that the tick calls as well.
  if (place(kmax_tick_code_stored) != place(kmax_tick_code_stored_end)) {
    copy(kmax_tick_code_image, kmax_tick_code_stored, kmax_tick_code_stored_end);
    map_tick_code();
  }
  copy(kmax_data_image, kmax_data_begin, kmax_data_end);
  clear(kmax_bss_begin, kmax_bss_end);
  clear(kmax_ccm_begin, kmax_ccm_end);
  for (const Constructor* constructor = kmax_constructors_begin; constructor != kmax_constructors_end;
       ++constructor) {
    (*constructor)();
  }
  ::main();
  for (;;) wait_for_interrupt();
}

}  // namespace

extern "C" [[noreturn, gnu::section(".boot.reset")]] void ISR_reset() {
  scb_cpacr::FpuAccess::set(scb().cpacr);
  data_synchronization_barrier();
  instruction_synchronization_barrier();
  // A boot loader that jumps here leaves its interrupts behind, whose handlers are not ready, and its table.
  for (auto& enabled : nvic().icer) enabled = ~0U;
  scb().vtor = reinterpret_cast<std::uintptr_t>(kmax_vectors);
  data_synchronization_barrier();
  start();
}

}  // namespace kmax::drivers::cortex_m
