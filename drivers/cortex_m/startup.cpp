// From the reset vector to main. PM0214 (FPU enabling, VTOR).

#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "drivers/cortex_m/vectors.hpp"

int main();

extern "C" {
extern const std::uint32_t kmax_vectors[];
extern std::uint32_t kmax_data_begin[];
extern std::uint32_t kmax_data_end[];
extern const std::uint32_t kmax_data_image[];
extern std::uint32_t kmax_bss_begin[];
extern std::uint32_t kmax_bss_end[];
using Constructor = void (*)();
extern const Constructor kmax_constructors_begin[];
extern const Constructor kmax_constructors_end[];
}

namespace kmax::drivers::cortex_m {

namespace {

/// The compiler may use FPU registers for anything, moving memory included, so all that follows the enabling
/// lives in a function of its own.
[[noreturn, gnu::noinline, gnu::section(".boot.start")]] void start() {
  const std::uint32_t* image = kmax_data_image;
  for (std::uint32_t* word = kmax_data_begin; word != kmax_data_end; ++word) *word = *image++;
  for (std::uint32_t* word = kmax_bss_begin; word != kmax_bss_end; ++word) *word = 0;
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
