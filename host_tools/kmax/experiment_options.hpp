#pragma once
// What the experiments' commands have in common: where their files go, whose hand is simulated, and how a
// device is handled.

#include <CLI/App.hpp>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/kmax/context.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::cli {

class ExperimentInterrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// --out and --format.
struct ExperimentFiles {
  std::string folder;           ///< empty: no files
  std::string ending = ".svg";  ///< of pictures
};
/// `contents`: what the help text of --out says.
void add_file_options(CLI::App& command, ExperimentFiles& files,
                      const std::string& contents = "Folder for CSV, pictures and a page");
/// Makes the folder, if one is wanted: before anybody presses anything.
void make_folder(const ExperimentFiles& files);
Json names_json(const std::vector<std::filesystem::path>& written);
/// A name a line.
void print_names(std::ostream& out, const std::vector<std::filesystem::path>& written);

/// --subjects; `people` stays empty without it.
void add_subjects_option(CLI::App& command, std::string& people);
/// Subject 1, or those of the set and its device. Throws simulation::SceneError.
std::vector<simulation::OperatorModel> people_of(const std::string& set, simulation::DeviceModel& device);

/// --activation-gain; negative: as the people are.
void add_activation_gain_option(CLI::App& command, double& activation_gain);
void set_activation_gain(std::vector<simulation::OperatorModel>& people, double activation_gain);

/// --force-limit and --abort-amplitude, which every experiment on a device takes; values in N and m.
void add_safety_options(CLI::App& command, double& force_limit, double& abort_amplitude);
/// --no-prompt and --patience (s), for somebody who is told before each touch what to do.
void add_touch_options(CLI::App& command, bool& no_prompt, double& patience);

}  // namespace kmax::cli
