#include "host_tools/experiment/report_words.hpp"

#include <fmt/format.h>

#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {

std::string yes_no(bool value) {
  return value ? "yes" : "no";
}

std::string yes_no(const TestedClaim& claim, std::string_view untested) {
  return claim ? yes_no(*claim) : std::string(untested);
}

std::string rank_text(const std::optional<double>& rank) {
  return rank ? fmt::format("{:+.2f}", *rank) : std::string("-");
}

std::string people_words(std::size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "person" : "people");
}

std::string touch_words(std::size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "touch" : "touches");
}

std::string fall_words(const TestedClaim& falls, std::string_view untested) {
  if (!falls) return std::string(untested);
  return *falls ? "falls" : "does not fall";
}

std::string cause_words(std::string_view number, const TestedClaim& falls, const TestedClaim& falls_without) {
  if (!falls || !falls_without)
    return "A hand that does not stiffen has nothing to compare with: not every F_I was touched both without "
           "F_B and with it.";
  const char* rest = "does not either: there is no trend to explain.";
  if (*falls && *falls_without)
    rest = "falls all the same: something else than the stiffening makes the trend.";
  else if (*falls)
    rest = "does not fall: in this model the trend is the stiffening and nothing else.";
  else if (*falls_without)
    rest = "falls at every F_I: the stiffening is not what would make the trend.";
  return fmt::format("With a hand that does not stiffen {} {}", number, rest);
}

std::string estimator_name(control::VelocityEstimatorKind estimator) {
  constexpr device::Parameter kinds = device::Parameter::of<"velocity.estimator">();
  return device::value_text(kinds, static_cast<std::uint32_t>(estimator));
}

std::string growing_wall_words() {
  return "The wall grows from wall.touch_stiffness: stable means here that it does not oscillate, not that "
         "it comes to its stiffness. Force over depth at the end of a touch's samples says what it has come "
         "to.";
}

std::string clipping_words(const simulation::DeviceModel& device) {
  return device.force_limit > 0.0 ? fmt::format("clipped at {:g} N", device.force_limit)
                                  : std::string("not clipped");
}

std::string model_words(const simulation::DeviceModel& device, const simulation::OperatorModel& person) {
  return fmt::format("The handle has {:g} g and {:g} N of friction, the hand's gamma is {:g} /N.",
                     device.mass * 1e3, device.friction, person.activation_gain);
}

}  // namespace kmax::experiment
