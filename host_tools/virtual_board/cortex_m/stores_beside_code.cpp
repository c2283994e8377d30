#include "host_tools/virtual_board/cortex_m/stores_beside_code.hpp"

#include <dlfcn.h>

#include <atomic>
#include <cstdint>

namespace kmax::virtual_board {
namespace {

std::atomic<bool> code_in_ram{false};
/// Unicorn's, of the engine that runs in this thread.
thread_local void* executing_core = nullptr;

bool only_data() {
  return !code_in_ram.load(std::memory_order_relaxed);
}

/// The library's own, behind the one of this program.
template <typename Function>
Function* of_the_library(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

void note_code_in_ram() {
  code_in_ram.store(true, std::memory_order_relaxed);
  static const auto forget_addresses = of_the_library<void(void* core)>("tlb_flush_arm");
  if (forget_addresses != nullptr && executing_core != nullptr) forget_addresses(executing_core);
}

}  // namespace kmax::virtual_board

// Their arguments are those of Unicorn 2.0.1's qemu/accel/tcg: translate-all.h, cputlb.c, cpu-exec.c.
#pragma GCC visibility push(default)
extern "C" {

// No engine's pages were collected while there was data only, so none have to be given back.
void* page_collection_lock_arm(void* engine, std::uintptr_t begin, std::uintptr_t end) {
  if (kmax::virtual_board::only_data()) return nullptr;
  static const auto lock =
      kmax::virtual_board::of_the_library<decltype(page_collection_lock_arm)>("page_collection_lock_arm");
  return lock(engine, begin, end);
}

void page_collection_unlock_arm(void* pages) {
  if (pages == nullptr) return;
  static const auto unlock =
      kmax::virtual_board::of_the_library<decltype(page_collection_unlock_arm)>("page_collection_unlock_arm");
  unlock(pages);
}

void tb_invalidate_phys_page_fast_arm(void* engine, void* pages, std::uintptr_t begin, int bytes,
                                      std::uintptr_t return_address) {
  if (pages == nullptr) return;
  static const auto invalidate =
      kmax::virtual_board::of_the_library<decltype(tb_invalidate_phys_page_fast_arm)>(
          "tb_invalidate_phys_page_fast_arm");
  invalidate(engine, pages, begin, bytes, return_address);
}

int cpu_exec_arm(void* engine, void* core) {
  static const auto execute = kmax::virtual_board::of_the_library<decltype(cpu_exec_arm)>("cpu_exec_arm");
  kmax::virtual_board::executing_core = core;
  return execute(engine, core);
}

// Puts a page into the table of addresses; `attributes` is a structure of bit fields.
void tlb_set_page_with_attrs_arm(void* core, std::uint32_t address, std::uint64_t physical,
                                 std::uint32_t attributes, int rights, int mode, std::uint32_t bytes) {
  static const auto set_page = kmax::virtual_board::of_the_library<decltype(tlb_set_page_with_attrs_arm)>(
      "tlb_set_page_with_attrs_arm");
  static const auto set_dirty =
      kmax::virtual_board::of_the_library<void(void* core, std::uint32_t address)>("tlb_set_dirty_arm");
  set_page(core, address, physical, attributes, rights, mode, bytes);
  // Only what was marked for the sake of translated code changes: registers and read-only memory are marked
  // otherwise.
  if (set_dirty != nullptr && kmax::virtual_board::only_data()) set_dirty(core, address);
}
}
#pragma GCC visibility pop
