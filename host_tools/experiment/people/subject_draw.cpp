#include <fmt/format.h>

#include <cmath>
#include <random>

#include "host_tools/experiment/people/subject_set.hpp"

namespace kmax::experiment {

std::vector<Subject> draw_subjects(std::size_t count, std::uint64_t seed,
                                   const simulation::OperatorModel& common, const HandRanges& ranges) {
  if (count == 0 || count > 10'000)
    throw std::invalid_argument(fmt::format("{} subjects: allowed is 1 to 10000", count));
  // The engine's numbers are fixed by the standard, those of its distributions are not.
  std::mt19937_64 random(seed);
  const auto between = [&random](const DrawnRange& range) {
    const double share = static_cast<double>(random() >> 11) * 0x1.0p-53;
    return range.least * std::pow(range.most / range.least, share);
  };
  std::vector<Subject> subjects;
  for (std::size_t n = 0; n < count; ++n) {
    Subject subject{fmt::format("drawn {}", n + 1), common};
    subject.person.grip_stiffness = between(ranges.grip_stiffness);
    subject.person.grip_damping = between(ranges.grip_damping);
    subject.person.hand_mass = between(ranges.hand_mass);
    subject.person.arm_stiffness = between(ranges.arm_stiffness);
    subject.person.arm_damping = between(ranges.arm_damping);
    subjects.push_back(std::move(subject));
  }
  return subjects;
}

}  // namespace kmax::experiment
