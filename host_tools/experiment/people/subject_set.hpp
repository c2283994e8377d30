#pragma once
// A group of simulated people, and the device they hold: what a study is made with. Kept in a TOML file, so
// that a result can be traced to every number that made it and run again.
//
//   name = "..."          description = "..."        seed = 1 (of the draw)
//   [fitted]              optional: plain, magnetic (N/m), force_limit (N), see Fitted. Only a calibration
//                         writes it; take it out of a file whose numbers you change
//   [device] [structure]  device_model.hpp
//   [[subject]]           name, and operator_model.hpp
//
// People are drawn independently and log-uniformly between the smallest and the largest value that Fu &
// Cavusoglu (2012) found over the three directions of a hand on a stylus. The five numbers of a real hand are
// not independent; nothing better is published.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::experiment {

struct Subject {
  std::string name;
  simulation::OperatorModel person;
};

// What friction and activation gain of a set were fitted to: the means of paper 1's plain wall and of its
// F_MC = 2 N, with a device of this force limit. All three are given, or none.
struct Fitted {
  double plain_target = 0.0;     // N/m
  double magnetic_target = 0.0;  // N/m
  double force_limit = 0.0;      // N; 0: none
};

struct SubjectSet {
  std::string name;
  std::string description;
  std::uint64_t seed = 0;        // of the draw
  std::optional<Fitted> fitted;  // none: nothing was fitted to these people and this device
  simulation::DeviceModel device;
  std::vector<Subject> subjects;
};

// Smallest and largest of a drawn quantity, SI.
struct DrawnRange {
  double least, most;
};
struct HandRanges {
  DrawnRange grip_stiffness{380.0, 770.0};
  DrawnRange grip_damping{0.78, 3.61};
  DrawnRange hand_mass{0.204, 0.269};
  DrawnRange arm_stiffness{79.0, 272.0};
  DrawnRange arm_damping{4.6, 18.1};
};

inline constexpr std::uint64_t study_seed = 1;

// The same seed gives the same people on every machine. `activation_gain` and what else is common to all is
// taken from `common`. Throws std::invalid_argument for a count of 0 or above 10,000.
std::vector<Subject> draw_subjects(std::size_t count, std::uint64_t seed,
                                   const simulation::OperatorModel& common = {},
                                   const HandRanges& ranges = {});

// Numbers that are not given keep the defaults of the models. Throw simulation::SceneError, whose text begins
// with file:line:column: syntax, unknown keys, values out of range, a [fitted] without one of its numbers,
// nobody in the set, a name given twice.
SubjectSet load_subject_set(const std::filesystem::path& path);
SubjectSet parse_subject_set(std::string_view text, std::string_view source);
// A file, or one of the sets in the program itself by its name if there is no such file.
SubjectSet open_subject_set(const std::string& name_or_path);

// The calibrated sets that the program brings along: "clipped", whose device makes no more than 3.3 N, and
// "unclipped". Made by `kmax experiment max-stiffness --calibrate` (scripts/experiments).
struct SuppliedSubjectSet {
  std::string_view name;
  std::string_view text;
};
std::vector<SuppliedSubjectSet> supplied_subject_sets();

// Reads back equal to the last bit.
std::string subject_set_text(const SubjectSet& set);
// The file appears whole or not at all. Throws std::runtime_error.
void store_subject_set(const SubjectSet& set, const std::filesystem::path& path);

}  // namespace kmax::experiment
