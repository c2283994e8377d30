#include "host_tools/virtual_board/cortex_m/stores_beside_code.hpp"

#include <dlfcn.h>

#include <cstdint>

namespace kmax::virtual_board {
namespace {

thread_local StoresBesideCode* running = nullptr;

/// The library's own, behind the one of this program.
template <typename Function>
Function* of_the_library(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

using ForCore = void(void* core);
using ForPage = void(void* core, std::uint32_t address);

ForCore* forgets_addresses() {
  static const auto function = of_the_library<ForCore>("tlb_flush_arm");
  return function;
}

}  // namespace

StoresBesideCode::Running::Running(StoresBesideCode& of) : before_(running) {
  running = &of;
}
StoresBesideCode::Running::~Running() {
  running = before_;
}

void StoresBesideCode::note_code_in_ram() {
  note(true);
}
void StoresBesideCode::note_data_only() {
  note(false);
}

void StoresBesideCode::note(bool code_in_ram) {
  if (code_in_ram_ == code_in_ram) return;
  code_in_ram_ = code_in_ram;
  if (forgets_addresses() != nullptr && core_ != nullptr) forgets_addresses()(core_);
}

}  // namespace kmax::virtual_board

// Their arguments are those of Unicorn 2.0.1's qemu/accel/tcg: translate-all.h, cputlb.c, cpu-exec.c.
#pragma GCC visibility push(default)
extern "C" {

// The pages of an engine that has data only were not collected, so none have to be given back.
void* page_collection_lock_arm(void* engine, std::uintptr_t begin, std::uintptr_t end) {
  using namespace kmax::virtual_board;
  if (running != nullptr && running->only_data()) return nullptr;
  static const auto lock = of_the_library<decltype(page_collection_lock_arm)>("page_collection_lock_arm");
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
  if (kmax::virtual_board::running != nullptr) kmax::virtual_board::running->set_core(core);
  return execute(engine, core);
}

// Puts a page into the table of addresses; `attributes` is a structure of bit fields.
void tlb_set_page_with_attrs_arm(void* core, std::uint32_t address, std::uint64_t physical,
                                 std::uint32_t attributes, int rights, int mode, std::uint32_t bytes) {
  using namespace kmax::virtual_board;
  static const auto set_page =
      of_the_library<decltype(tlb_set_page_with_attrs_arm)>("tlb_set_page_with_attrs_arm");
  static const auto set_dirty = of_the_library<ForPage>("tlb_set_dirty_arm");
  set_page(core, address, physical, attributes, rights, mode, bytes);
  // Only what was marked for the sake of translated code changes: registers, and memory that the engine knows
  // as read-only, are marked otherwise. What could not be forgotten again is left as it is.
  if (running != nullptr && running->only_data_for(core) && set_dirty != nullptr &&
      forgets_addresses() != nullptr)
    set_dirty(core, address);
}
}
#pragma GCC visibility pop
