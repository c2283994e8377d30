#include "host_tools/virtual_board/cortex_m/stores_beside_code.hpp"

#include <dlfcn.h>

#include <atomic>
#include <cstdint>

namespace kmax::virtual_board {
namespace {

std::atomic<bool> code_in_ram{false};

bool only_data() {
  return !code_in_ram.load(std::memory_order_relaxed);
}

/// The library's own, behind the one of this program.
template <typename Function>
Function* of_the_library(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

void note_code_in_ram() {
  code_in_ram.store(true, std::memory_order_relaxed);
}

}  // namespace kmax::virtual_board

// Their arguments, of Unicorn 2.0.1's qemu/accel/tcg/translate-all.h: an engine, pages of it, addresses in
// its RAM, bytes, a return address. No engine's pages were collected while there was data only, so none have
// to be given back.
#pragma GCC visibility push(default)
extern "C" {

void* page_collection_lock_arm(void* engine, std::uintptr_t begin, std::uintptr_t end) {
  if (kmax::virtual_board::only_data()) return nullptr;
  static const auto lock =
      kmax::virtual_board::of_the_library(&page_collection_lock_arm, "page_collection_lock_arm");
  return lock(engine, begin, end);
}

void page_collection_unlock_arm(void* pages) {
  if (pages == nullptr) return;
  static const auto unlock =
      kmax::virtual_board::of_the_library(&page_collection_unlock_arm, "page_collection_unlock_arm");
  unlock(pages);
}

void tb_invalidate_phys_page_fast_arm(void* engine, void* pages, std::uintptr_t begin, int bytes,
                                      std::uintptr_t return_address) {
  if (pages == nullptr) return;
  static const auto invalidate = kmax::virtual_board::of_the_library(&tb_invalidate_phys_page_fast_arm,
                                                                     "tb_invalidate_phys_page_fast_arm");
  invalidate(engine, pages, begin, bytes, return_address);
}
}
#pragma GCC visibility pop
