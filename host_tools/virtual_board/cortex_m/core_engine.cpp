#include "host_tools/virtual_board/cortex_m/core_engine.hpp"

#include <unicorn/unicorn.h>

#include <array>
#include <stdexcept>
#include <string>

namespace kmax::virtual_board {
namespace {

constexpr std::size_t longest_list = 32;

}  // namespace

void CoreEngine::check(int error, const char* what) {
  if (error == UC_ERR_OK) return;
  throw std::runtime_error(std::string("Unicorn, ") + what + ": " + uc_strerror(static_cast<uc_err>(error)));
}

CoreEngine::CoreEngine() {
  // Not UC_MODE_MCLASS: in this version it makes a Cortex-M33 of the model, which loses FPSCR over
  // exceptions.
  check(uc_open(UC_ARCH_ARM, UC_MODE_THUMB, &engine_), "opening the engine");
  check(uc_ctl_set_cpu_model(engine_, UC_CPU_ARM_CORTEX_M4), "choosing the Cortex-M4");
}

CoreEngine::~CoreEngine() {
  uc_close(engine_);
}

std::uint32_t CoreEngine::get(int identifier) const {
  std::uint64_t value = 0;
  uc_reg_read(engine_, identifier, &value);
  return static_cast<std::uint32_t>(value);
}

void CoreEngine::set(int identifier, std::uint32_t value) {
  const std::uint64_t wide = value;
  uc_reg_write(engine_, identifier, &wide);
}

void CoreEngine::get(std::span<const int> identifiers, std::span<std::uint64_t> values) const {
  std::array<void*, longest_list> places{};
  for (std::size_t index = 0; index < identifiers.size(); ++index) {
    values[index] = 0;
    places[index] = &values[index];
  }
  uc_reg_read_batch(engine_, const_cast<int*>(identifiers.data()), places.data(),
                    static_cast<int>(identifiers.size()));
}

void CoreEngine::set(std::span<const int> identifiers, std::span<const std::uint64_t> values) {
  std::array<void*, longest_list> places{};
  for (std::size_t index = 0; index < identifiers.size(); ++index) {
    places[index] = const_cast<std::uint64_t*>(&values[index]);
  }
  uc_reg_write_batch(engine_, const_cast<int*>(identifiers.data()), places.data(),
                     static_cast<int>(identifiers.size()));
}

}  // namespace kmax::virtual_board
