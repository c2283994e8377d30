#include "host_tools/experiment/report_words.hpp"

#include <fmt/format.h>

namespace kmax::experiment {

std::string yes_no(bool value) {
  return value ? "yes" : "no";
}

std::string rank_text(const std::optional<double>& rank) {
  return rank ? fmt::format("{:+.2f}", *rank) : std::string("-");
}

std::string people_words(std::size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "person" : "people");
}

std::string clipping_words(const simulation::DeviceModel& device) {
  return device.force_limit > 0.0 ? fmt::format("clipped at {:g} N", device.force_limit)
                                  : std::string("not clipped");
}

}  // namespace kmax::experiment
