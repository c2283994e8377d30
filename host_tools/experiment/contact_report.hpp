#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/contact_experiment.hpp"

namespace kmax::experiment {

/// The results beside the paper's words, as a table for the terminal.
std::string contact_table(const std::vector<ContactResult>& results);

/// A picture (position, force and F_MC over time) and a CSV file with the same base name for one condition.
/// Returns the names written. Throws plot::FigureError or std::runtime_error.
std::vector<std::filesystem::path> write_contact(const ContactResult& result,
                                                 const std::filesystem::path& folder,
                                                 const std::string& picture_ending);

std::string_view words_of(simulation::ContactVerdict verdict);

}  // namespace kmax::experiment
