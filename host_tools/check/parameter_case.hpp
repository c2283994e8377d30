#pragma once

#include <cstddef>
#include <vector>

#include "control/stability_criteria.hpp"
#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::check {

/// What the criteria judge of one axis, see firmware/drive/stability_case.hpp: with the hand that holds it,
/// and each number as the user wrote it: 0.1, not the 0.100000001490116 of the float that is nearest to it.
control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand = {});

/// The parameters that it reads, of that axis.
std::vector<device::Parameter> parameters_of_case(std::size_t axis);

}  // namespace kmax::check
