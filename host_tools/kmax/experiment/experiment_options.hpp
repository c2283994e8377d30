#pragma once
// What the experiments' commands have in common: where their files go, whose hand is simulated, and how a
// device is handled.

#include <CLI/App.hpp>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/experiment/touch_changes.hpp"
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
  std::string date, commit;     ///< that a page names; empty: today, and what the program came from
};
/// `contents`: what the help text of --out says.
void add_file_options(CLI::App& command, ExperimentFiles& files,
                      const std::string& contents = "Folder for CSV, pictures and a page");
/// --format alone.
void add_format_option(CLI::App& command, std::string& ending);
/// When and with what a page is made, by --date and --commit.
experiment::Provenance provenance_of(const ExperimentFiles& files);
/// Makes the folder, if one is wanted: before anybody presses anything.
void make_folder(const ExperimentFiles& files);
Json names_json(const std::vector<std::filesystem::path>& written);
/// A name a line.
void print_names(std::ostream& out, const std::vector<std::filesystem::path>& written);

/// --subjects; `people` stays empty without it.
void add_subjects_option(CLI::App& command, std::string& people);
/// Subject 1, or those of the set and its device. Throws simulation::SceneError.
std::vector<simulation::OperatorModel> people_of(const std::string& set, simulation::DeviceModel& device);

/// --subjects, --activation-gain and --clip: whom the forces of a simulated device push, and how far it goes.
struct PeopleOptions {
  std::string subjects;
  double activation_gain = -1.0;  ///< 1/N, of everybody; negative: as the people are
  double clip = 0.0;              ///< N; 0: no limit
};
/// --subjects and --activation-gain.
void add_people_options(CLI::App& command, PeopleOptions& options);
void add_clip_option(CLI::App& command, double& clip);
/// As people_of() of the set, with the gain, and the device with the limit, that the options give.
std::vector<simulation::OperatorModel> people_of(const PeopleOptions& options,
                                                 simulation::DeviceModel& device);

/// A device that is simulated here. Its notices go to the context's.
device::Device simulated_device(Context& context, const simulation::Scene& scene);

/// --expect-paper: a result that differs from the paper's gives exit code 3.
void add_expect_paper_option(CLI::App& command, bool& expect);
/// done, or verdict_is_no where the paper's result is expected and is not there.
int paper_exit_code(bool expect, bool as_paper);

/// --set NAME=VALUE, of every touch.
void add_touch_settings_option(CLI::App& command, std::vector<std::string>& settings);
/// UsageError for what is not to be changed, or not to that value.
experiment::TouchChanges touch_changes(const std::vector<std::string>& settings,
                                       experiment::Touching touching,
                                       experiment::Varied varied = experiment::Varied::papers_walls);
/// `rate`: the option that says haptic.rate too; UsageError for both.
void change_touches(experiment::ContactSettings& touch, const experiment::TouchChanges& changes,
                    const CLI::Option& rate);

/// --force-limit and --abort-amplitude, which every experiment on a device takes.
void add_safety_options(CLI::App& command, experiment::TouchLimits& limits);
/// --no-prompt and --patience (s), for somebody who is told before each touch what to do.
void add_touch_options(CLI::App& command, bool& no_prompt, double& patience);

}  // namespace kmax::cli
