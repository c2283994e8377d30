#pragma once

#include <functional>
#include <vector>

#include "host_tools/check/judgement.hpp"

namespace kmax::check {

/// Whether a set of parameters does what is wanted.
using Wanted = std::function<bool(const firmware::ParameterValues&)>;

/// Single parameters whose change alone makes `wanted` true, the user's own choices first, then the facts
/// about device and operator. For each: the change nearest to the present value, rounded to three digits (or
/// as few more as it takes) towards the side on which it is still true.
///
/// `values` is a set for which `wanted` is false. Each parameter is walked from its present value to the end
/// of its range in 60 steps, so what is true only within a gap narrower than that is not found. About 1000
/// calls of `wanted`.
std::vector<Change> find_changes(const firmware::ParameterValues& values, std::size_t axis,
                                 const Wanted& wanted);

}  // namespace kmax::check
