#pragma once
// What the studies of the largest stiffness found, as sections of a page: tables with the paper's value
// beside ours, and in words what holds and what does not. Every number in the words is taken from the
// results.

#include "host_tools/experiment/max_stiffness/cause_study.hpp"
#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"
#include "host_tools/experiment/max_stiffness/study_variation.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

// "force clipped at 3.3 N" or "force not clipped".
std::string clip_words(const simulation::DeviceModel& device);

// Figs. 6 and 8, one column of ours per study.
report::Table max_stiffness_table(const std::vector<MaxStiffnessStudy>& studies);
report::Table subject_table(const MaxStiffnessStudy& study);
report::Section max_stiffness_section(const std::vector<MaxStiffnessStudy>& studies);

// Do the calibrated conditions come out within their tolerance, and the constant coefficients, fitted or not,
// in rising order?
bool as_calibrated(const MaxStiffnessStudy& study);

report::Section calibration_section(const std::vector<OperatorCalibration>& calibrations);

struct ClippedCauses {
  SubjectSet set;
  std::vector<CauseResult> causes;
  std::vector<FieldLengthResult> lengths;
};
report::Section cause_section(const std::vector<ClippedCauses>& results);

report::Section variation_section(const std::string& heading, const std::vector<VariationResult>& results);

}  // namespace kmax::experiment
