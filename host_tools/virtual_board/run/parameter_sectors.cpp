#include "host_tools/virtual_board/run/parameter_sectors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "firmware/parameters/parameter_rules.hpp"
#include "firmware/parameters/parameter_store.hpp"
#include "host_tools/virtual_board/bus.hpp"

namespace kmax::virtual_board {

ParameterSectors::ParameterSectors(Bus& bus)
    : bytes_(bus.flash().subspan(memory_map::parameters.base - memory_map::flash.base,
                                 memory_map::parameters.size)) {}

std::uint32_t ParameterSectors::read(std::size_t sector, std::size_t word) const {
  std::uint32_t value = 0;
  std::memcpy(&value, &bytes_[4 * (sector * words_per_sector + word)], sizeof value);
  return value;
}

bool ParameterSectors::erase(std::size_t sector) {
  const auto place = bytes_.subspan(4 * sector * words_per_sector, 4 * words_per_sector);
  std::fill(place.begin(), place.end(), std::uint8_t{0xFF});
  return true;
}

bool ParameterSectors::program(std::size_t sector, std::size_t word, std::uint32_t value) {
  const std::uint32_t cleared = read(sector, word) & value;
  std::memcpy(&bytes_[4 * (sector * words_per_sector + word)], &cleared, sizeof cleared);
  return cleared == value;
}

void store_parameters(VirtualBoard& board, const std::vector<device::Assignment>& assignments) {
  ParameterSectors sectors(board.chip().bus());
  firmware::ParameterStore<ParameterSectors> store(sectors);
  firmware::ParameterValues values;
  static_cast<void>(store.load(values));
  for (const device::Assignment& assignment : assignments)
    values.set_raw(firmware::slot_of(assignment.parameter.entry(), assignment.parameter.axis()),
                   assignment.raw);
  store.begin(values);
  firmware::SaveProgress progress = firmware::SaveProgress::busy;
  while (progress == firmware::SaveProgress::busy) progress = store.step();
  if (progress != firmware::SaveProgress::done)
    throw std::runtime_error("the parameters do not fit into the board's flash: its sectors are damaged");
}

}  // namespace kmax::virtual_board
