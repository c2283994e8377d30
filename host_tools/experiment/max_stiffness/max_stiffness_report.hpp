#pragma once
// What the study of the largest stiffness found, as a section of a page and a picture: the paper's value
// beside ours, and in words what holds and what does not. Every number in the words is taken from the
// results.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// Means of largest stiffnesses for a table, marked where they are made of bounds: "<" where some people had
/// no stable stiffness and count as 0, ">" where some were stable up to the last one and count with that. The
/// notes below the table say for how many.
class MarkedMeans {
 public:
  /// The mean in N/mm with its marks. `what`: how the notes call it.
  std::string cell(double mean, const CountedEnds& ends, std::size_t people, const std::string& what);
  /// One for each kind of mark that was needed.
  std::vector<std::string> notes() const;

 private:
  std::string at_zero_, beyond_last_;
};

/// "force clipped at 3.3 N" or "force not clipped".
std::string clip_words(const simulation::DeviceModel& device);

// Figs. 6 and 8, one column of ours per study.
report::Table max_stiffness_table(const std::vector<MaxStiffnessStudy>& studies);
report::Table subject_table(const MaxStiffnessStudy& study);
report::Section max_stiffness_section(const std::vector<MaxStiffnessStudy>& studies);

/// Do the calibrated conditions come out within their tolerance, and the constant coefficients, fitted or
/// not, in rising order?
bool as_calibrated(const MaxStiffnessStudy& study);

report::Section calibration_section(const std::vector<OperatorCalibration>& calibrations);

/// The mean over F_MC, with what the paper prints, and every adaptive mode as a level; all of it in sight.
plot::Figure max_stiffness_figure(const std::vector<MaxStiffnessStudy>& studies);
/// What is said under it: which of the values are calibrated.
std::string max_stiffness_caption(const std::vector<MaxStiffnessStudy>& studies);
/// Draws it; the file's folder must exist. Throws plot::FigureError.
report::Picture draw_max_stiffness(const std::vector<MaxStiffnessStudy>& studies,
                                   const std::filesystem::path& file);

}  // namespace kmax::experiment
