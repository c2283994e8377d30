#include "host_tools/check/parameter_case.hpp"

#include "firmware/drive/stability_case.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::check {

control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand) {
  auto judged = firmware::stability_case<double>(values, axis, device::shortest_double);
  judged.hand = hand;
  return judged;
}

std::vector<device::Parameter> parameters_of_case(std::size_t axis) {
  std::vector<device::Parameter> all;
  for (const auto& one : firmware::case_parameters) all.emplace_back(one.entry, axis);
  return all;
}

}  // namespace kmax::check
