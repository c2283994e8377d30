#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// The results beside the paper's words, as a table for the terminal.
std::string contact_table(const std::vector<ContactResult>& results);

/// A picture (position, force and F_MC over time) and a CSV file with the same base name for one condition.
/// Returns the names written. Throws plot::FigureError or std::runtime_error.
std::vector<std::filesystem::path> write_contact(const ContactResult& result,
                                                 const std::filesystem::path& folder,
                                                 const std::string& picture_ending);

/// What was done, in sentences.
std::vector<std::string> contact_words(const ContactSettings& settings, std::size_t trials,
                                       const std::string& velocity_estimator);

/// contact.md and contact.html in the folder of the pictures, which must be as write_contact() left them:
/// one for each result. `words`: contact_words(). `origin`: of the results, which a device measures and a
/// simulation predicts. Returns the names written. Throws std::runtime_error.
std::vector<std::filesystem::path> write_contact_page(const std::vector<ContactResult>& results,
                                                      const std::vector<std::string>& words,
                                                      const std::vector<std::filesystem::path>& pictures,
                                                      const std::filesystem::path& folder,
                                                      report::Origin origin);

std::string_view to_string(simulation::ContactVerdict verdict);

}  // namespace kmax::experiment
