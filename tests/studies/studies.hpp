#pragma once
// One-off studies around the largest stable stiffness: what the numbers of docs/experiments/max_stiffness.md
// come from and how far they can be trusted. The program kmax-studies (main.cpp) runs them; no product needs
// them.
//
// Each has a file of its own. Its sweep over walls and people is data; its section has a table with the
// paper's value beside ours where there is one, and words that follow the numbers.

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/experiment/design/design_task.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_report.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/experiment/touch_price.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/report/page.hpp"
#include "tests/studies/raw_data.hpp"

namespace kmax::studies {

using experiment::CountedEnds;
using experiment::MaxStiffness;
using experiment::StiffnessCondition;
using experiment::StiffnessRun;
using experiment::SubjectSet;
using experiment::TouchProtocol;
using experiment::TouchSetup;

/// The largest stable stiffness of one wall over the people of a set.
struct PeopleMean {
  double mean = 0.0;                   ///< N/m
  CountedEnds ends{};                  ///< of the people
  double saturated_share = 0.0;        ///< largest, simulated_touch.hpp
  std::vector<MaxStiffness> people{};  ///< in the order of the set
};

struct StudyInput {
  std::vector<SubjectSet> sets;  ///< calibrated, at least one
  StiffnessRun run;
  std::filesystem::path folder;                        ///< of pictures; empty: none are drawn
  std::function<void(std::string_view study)> done{};  ///< hears of each study when it has been made
  RawData* raw = nullptr;                              ///< hears of each of the people
  void keep(std::string_view study, const SubjectSet& set, std::string_view wall, std::string_view criterion,
            const PeopleMean& found) const;
};

struct Study {
  std::string_view name, what;
  std::vector<report::Section> (*run)(const StudyInput& input);
};

/// Figs. 6 and 8: as `kmax experiment max-stiffness` has it.
std::vector<report::Section> largest(const StudyInput& input);
std::vector<report::Section> held_walls(const StudyInput& input);
std::vector<report::Section> causes(const StudyInput& input);
std::vector<report::Section> assumptions(const StudyInput& input);
std::vector<report::Section> compliance(const StudyInput& input);
std::vector<report::Section> draws(const StudyInput& input);
std::vector<report::Section> adaptive_gap(const StudyInput& input);
std::vector<report::Section> baselines(const StudyInput& input);
std::vector<report::Section> damping_map(const StudyInput& input);
std::vector<report::Section> growing_walls(const StudyInput& input);
std::vector<report::Section> loop_rates(const StudyInput& input);

/// In the order of the page: the strongest result first.
inline constexpr std::array<Study, 11> all_studies{{
    {"rates",
     "500 Hz to 20 kHz, two encoders, delays and velocity estimators; the first set's device is used",
     loop_rates},
    {"largest", "the largest stable stiffness of each person under each law (Figs. 6 and 8)", largest},
    {"figures", "a wall of 5.5 N/mm held under each law (Figs. 9 to 12), V of eq. 7 as printed and rescaled",
     held_walls},
    {"causes", "the four causes of the gain at 2 N, one by one", causes},
    {"assumptions", "threshold, pushes, approach speeds, device, integrator: what hangs on them",
     assumptions},
    {"compliance", "a device that bends between motor and hand, and more touches within a sample",
     compliance},
    {"draws", "25 other groups of people, each calibrated for itself; the first set is used", draws},
    {"adaptive", "what would make the adaptive wall reach the paper's 8.02 N/mm", adaptive_gap},
    {"baselines", "damping, passivity control, relation and interval of eq. 7, and what each wall costs",
     baselines},
    {"damping",
     "stiffness against damping for each estimator, rate, encoder, delay and compliance; the first set",
     damping_map},
    {"growing", "walls that grow stiff while the contact is calm, on 12 people and 200 drawn devices",
     growing_walls},
}};

/// The named ones, all of them for "all". Throws std::invalid_argument for an unknown name and for no people.
std::vector<report::Section> run_studies(const std::vector<std::string>& names, const StudyInput& input);

std::string n_per_mm(double stiffness);
using experiment::estimator_name;
using experiment::felt_force;
inline constexpr std::array all_estimators{
    control::VelocityEstimatorKind::difference, control::VelocityEstimatorKind::low_pass,
    control::VelocityEstimatorKind::foaw,       control::VelocityEstimatorKind::foaw_end_fit,
    control::VelocityEstimatorKind::tracking,   control::VelocityEstimatorKind::edge_period};

// --- Sweeps over walls (sweep.cpp) ------------------------------------------------------------------------

PeopleMean mean_of(std::span<const MaxStiffness> people);
/// Of what each of the people can have by the one of two criteria that gives it less.
PeopleMean smaller_of_each(const PeopleMean& one, const PeopleMean& other);

/// What makes a wall of the touch that everybody begins with.
using WallChange = std::function<void(TouchSetup&)>;
std::vector<PeopleMean> sweep(const SubjectSet& set, const std::vector<WallChange>& walls,
                              const StiffnessRun& run);
/// By each of several protocols, which are searched at once and take the place of the run's:
/// experiment::search_max_stiffness_by_each() says which may be.
std::vector<std::vector<PeopleMean>> sweep(const SubjectSet& set, const std::vector<WallChange>& walls,
                                           const std::vector<TouchProtocol>& protocols,
                                           const StiffnessRun& run);
/// Likewise of any touches, [protocol][setup].
std::vector<std::vector<MaxStiffness>> search_by_each(const std::vector<TouchSetup>& setups,
                                                      const std::vector<TouchProtocol>& protocols,
                                                      const StiffnessRun& run);
/// By the position, by the force, and by both: the mean of what each of the people can have by the criterion
/// that gives it less.
struct TwoMeans {
  PeopleMean moves{}, feels{}, both{};
};
std::vector<TwoMeans> sweep_by_both(const SubjectSet& set, const std::vector<WallChange>& walls,
                                    const StiffnessRun& run);
/// By the position as the run has it, and by the force that people feel.
std::vector<TouchProtocol> by_both(const StiffnessRun& run);

// --- Figs. 9 to 12 of paper 1: one stiffness held under every law (held_walls.cpp) -------------------------

/// All touches of one person.
struct HeldWall {
  std::size_t touches = 0, unstable = 0;
  double worst = 0.0;  ///< m peak to peak, in the touch that moved most
  bool stable() const { return unstable == 0; }
};

struct HeldWallResult {
  StiffnessCondition condition;
  std::string figure;  ///< of paper 1
  bool paper_stable = false;
  std::vector<HeldWall> people;  ///< in the order of the set
  HeldWall named;                ///< "subject 1": the person of the supplied scenes, with the set's gamma
  std::size_t stable_people() const;
  double median_worst() const;  ///< m
};

/// Nothing is fitted to it itself, but without a field and with 2 N the fitted means imply it. The paper
/// shows one person, about whom it says nothing.
std::vector<HeldWallResult> hold_walls(const SubjectSet& set, double stiffness, const StiffnessRun& run);
/// Fig. 8's adaptive walls with V as printed and rescaled: the conditions of `study`, in halves. `more` is
/// the mean of each person's own difference.
report::Table rescaled_table(const experiment::MaxStiffnessStudy& study);
report::Section held_wall_section(const SubjectSet& set, const std::vector<HeldWallResult>& results);

// --- Where the gain of F_MC = 2 N comes from (causes.cpp) --------------------------------------------------

/// What is left of the four things that a field of F_MC = 2 N changes: the hand stiffens, the field reaches
/// out in front of the wall, its force is there as a preload, and a force limit, which is the device's, is
/// met sooner.
struct CauseCondition {
  std::string name;
  std::string what;
  bool field = false;             ///< paper 1, eqs. 5 and 6
  double magnetic_length = 1e-3;  ///< m; nearly 0: the field's force inside the wall only
  bool preload = false;           ///< F_MC everywhere instead of the field
  bool stiffens = false;          ///< the hand, with what is commanded
  double grip_factor = 1.0;       ///< of k1 and b1, from the beginning
  double arm_factor = 1.0;        ///< of k2 and b2
  void apply(TouchSetup& setup) const;
};

/// `grown`: 1 + gamma 2 N, what a hand grows by that has got used to 2 N.
std::vector<CauseCondition> cause_conditions(double grown);
/// The field alone, with the hand unchanged, by its length.
std::vector<CauseCondition> fields_of(const std::vector<double>& lengths);

/// What is looked for lies far below the 1 N/mm that other searches begin with: a field that no hand answers
/// is unstable there already. N/m; the run's own first stiffness is not used.
inline constexpr double cause_first_stiffness = 100.0;
std::vector<PeopleMean> run_causes(const SubjectSet& set, const std::vector<CauseCondition>& conditions,
                                   const StiffnessRun& run);

inline const std::vector<double> field_lengths{0.25e-3, 0.5e-3, 1e-3, 2e-3, 5e-3};  ///< x_0, m
struct CausesOfSet {
  SubjectSet set;
  std::vector<PeopleMean> causes;   ///< of cause_conditions()
  std::vector<PeopleMean> lengths;  ///< of field_lengths
};
report::Section cause_section(const std::vector<CausesOfSet>& results);

// --- What nobody knows (variations.cpp) --------------------------------------------------------------------

/// The study with other people, touches, criterion, device or integrator: with the calibrated numbers left as
/// they are, or with both fitted again to the same targets. What the two then predict differently is what the
/// targets do not identify.
struct Variation {
  std::string name;
  std::string group;  ///< what is varied
  bool refit = false;
  SubjectSet set;
  TouchProtocol protocol;
  simulation::IntegratorConfig integrator{};
};
using simulation::bend;
/// From a calibrated set: all but the two below.
std::vector<Variation> assumption_variations(const SubjectSet& set, const TouchProtocol& protocol);
/// A structure that bends, and more phases of a touch.
std::vector<Variation> compliance_variations(const SubjectSet& set, const TouchProtocol& protocol);
/// Other people: the seeds 1 to `groups`, each fitted again.
std::vector<Variation> draw_variations(const SubjectSet& set, const TouchProtocol& protocol,
                                       std::size_t groups);

struct VariationResult {
  Variation variation;
  double friction = 0.0, activation_gain = 0.0;  ///< N, 1/N
  std::vector<PeopleMean> means;                 ///< in the order of stiffness_conditions()
  /// Did a fit reach its two targets (operator_calibration.hpp)? One that did not says nothing about what the
  /// targets leave open.
  bool plain_met = true, magnetic_met = true;
  bool met() const { return plain_met && magnetic_met; }
};
/// One job each: a variation is a long chain of small searches. Steps and threads are the run's.
std::vector<VariationResult> run_variations(const std::vector<Variation>& variations,
                                            const experiment::CalibrationSettings& calibration,
                                            const StiffnessRun& run);
/// With sentences on what holds in how many of the results; those whose fit missed count neither way.
report::Section variation_section(const std::string& heading, const std::vector<VariationResult>& results);

// --- What would make the adaptive wall reach the 8.02 N/mm of Fig. 8 (adaptive_gap.cpp) --------------------

struct ApproachResult {
  double approach_speed = 0.0;  ///< m/s, intended, the only one of the touches
  /// F_MC = 2 N constant; instant, latched, peak_hold; peak_hold whose hold is far longer than the touch.
  std::array<PeopleMean, 5> walls{};
  double coefficient_at_contact = 0.0;  ///< N, mean, of the last wall at its largest stiffness
  double speed_at_contact = 0.0;        ///< m/s, likewise
};
std::vector<ApproachResult> run_approaches(const SubjectSet& set, const std::vector<double>& speeds,
                                           const StiffnessRun& run);

struct NeededCoefficient {
  double coefficient = 0.0;     ///< N, constant
  double mean = 0.0;            ///< N/m, what it gives: as near to the target as steps of the mean allow
  double approach_speed = 0.0;  ///< m/s, at which eq. 7 commands that much
};
/// Searched between 0 and 4 N, all touches of the run's protocol.
NeededCoefficient coefficient_for(const SubjectSet& set, double target, const StiffnessRun& run);

/// Eq. 7 with another V_max: what it would be if the speed were counted in another unit.
struct SlopeResult {
  double velocity_max = 0.0;          ///< m/s
  std::array<PeopleMean, 3> modes{};  ///< instant, latched, peak_hold
};
std::vector<SlopeResult> run_slopes(const SubjectSet& set, const std::vector<double>& velocities,
                                    const StiffnessRun& run);
/// As a hypothesis, with what speaks against it.
report::Section slope_section(const SubjectSet& set, const std::vector<SlopeResult>& slopes);

report::Section adaptive_gap_section(const SubjectSet& set, const std::vector<ApproachResult>& approaches,
                                     const NeededCoefficient& needed);

// --- Walls that the paper did not compare its own with, and what each costs (baselines.cpp) ----------------

/// Time-domain passivity control of the wall (Hannaford and Ryu, IEEE Trans. Robotics and Automation 18(1),
/// 2002): what the wall has given the handle since it came in, by the force held over the last interval and
/// the displacement made in it, is taken back by a damper of at most `most` N s/m. Asked for nothing outside
/// and where the handle has not moved by a count.
class PassivityController {
 public:
  /// `stored_stiffness`: N/m; above 0 the wall may give back only what such a spring holds, else what it
  /// took.
  PassivityController(double count_length, double period, double most, double stored_stiffness)
      : count_length_(count_length), period_(period), most_(most), stored_stiffness_(stored_stiffness) {}
  /// N along +x; the surface is at 0, free space above.
  double added(std::int64_t count, const control::HapticLoop<float>::Output& last);

 private:
  double count_length_, period_, most_, stored_stiffness_;
  double position_ = 0.0, given_ = 0.0;  ///< m, J
};

WallChange damped(double damping, control::VelocityEstimatorKind estimator);
WallChange passivity_controlled(double most, bool keeps_spring);

struct Baseline {
  std::string name;
  WallChange wall;
  const experiment::paper::MaxStiffness* paper = nullptr;  ///< of the same wall
  std::string family{};                                    ///< one curve of the front
};
/// Those of paper 1.
Baseline plain_wall();
Baseline field_of_two();
Baseline adaptive_as_printed();
std::vector<Baseline> law_baselines();
/// The adaptive wall with each relation in each mode, and with other intervals of F_MC.
std::vector<Baseline> relation_baselines();

/// What a person pays: of one touch at 0.2 m/s of a wall of `stiffness` N/m, mean of the people.
using WallPrice = experiment::TouchPrice;
WallPrice price_of(const SubjectSet& set, const WallChange& wall, double stiffness);

/// The share of a force by which another must differ to be noticed: 7 % in matching forces of the arm (Jones
/// 1989, Perception 18, 681 to 687), 5 to 10 % and 7 % in the mean in pinching at 2.5 to 10 N (Pang, Tan and
/// Durlach 1991, Perception and Psychophysics 49, 531 to 540).
inline constexpr double noticed_share = 0.07;

struct BaselineResult {
  Baseline law;
  PeopleMean moves, phases, feels;  ///< by the position, the same with four phases, by the force
  PeopleMean both;                  ///< of each of the people the smaller by position and force
  PeopleMean notices;               ///< by a force that swings by noticed_force()
  WallPrice price;
};
std::vector<BaselineResult> run_baselines(const SubjectSet& set, const std::vector<Baseline>& laws,
                                          const StiffnessRun& run);
/// Largest stiffness by both criteria against what each wall costs, a curve a family.
plot::Figure price_front(const SubjectSet& set, const std::vector<BaselineResult>& results);
report::Section baseline_section(const SubjectSet& set, const std::vector<BaselineResult>& results);
/// N peak to peak: noticed_share of the device's largest force; of one that never clips, of the papers'.
double noticed_force(const SubjectSet& set);
/// Some of them with an encoder ten times finer, by what people notice: name and result.
using NoticedWalls = std::vector<std::pair<std::string, PeopleMean>>;
NoticedWalls run_noticed_with_finer_encoder(const SubjectSet& set, const StiffnessRun& run);
/// The walls by what people notice, whatever our own threshold is.
report::Section noticed_section(const SubjectSet& set, const std::vector<BaselineResult>& results,
                                const NoticedWalls& finer);
report::Section relation_section(const SubjectSet& set, const std::vector<BaselineResult>& results);

// --- Stiffness against damping (damping_map.cpp) ----------------------------------------------------------

/// What is changed of loop and device, one thing at a time.
struct LoopSetting {
  std::string name;
  WallChange change;
};
std::vector<LoopSetting> loop_settings();
inline constexpr std::array map_dampings{2.0, 4.0, 8.0, 12.0, 24.0};  ///< N s/m

struct DampingMap {
  LoopSetting setting;
  std::array<TwoMeans, 3> laws;  ///< plain_wall(), field_of_two(), adaptive_as_printed()
  std::array<std::array<TwoMeans, map_dampings.size()>, all_estimators.size()> damped;
};
/// Plain walls with damping, and the paper's without, in steps of 3 %.
std::vector<DampingMap> run_damping_map(const SubjectSet& set, const std::vector<LoopSetting>& settings,
                                        const StiffnessRun& run);
/// Of the first setting the whole map, of each the best damping with each estimator.
report::Section damping_section(const SubjectSet& set, const std::vector<DampingMap>& maps);
/// Throws plot::FigureError.
report::Picture draw_damping_map(const DampingMap& map, const std::filesystem::path& file);

// --- Walls that grow stiff (growing_walls.cpp) ------------------------------------------------------------

/// wall.touch_stiffness, wall.growth_time, and a damper over one sample. N/m, s, N s/m. `calm_by`: what the
/// handle is called calm by.
WallChange growing(double touch_stiffness, double growth_time, double damping,
                   control::VelocityEstimatorKind calm_by = control::VelocityEstimatorKind::foaw);
/// Adds -1.5 N, into the wall, and then +1.5 N for 20 ms each, 1.9 and 2.05 s after the first contact.
void pulse(TouchSetup& setup);

/// A device, who holds it, and what a wall is set to for it.
struct DrawnDevice {
  simulation::DeviceModel device;
  std::size_t person = 0;  ///< of the set
  double mass() const { return device.mass + (device.structure ? device.structure->handle_mass : 0.0); }
};
/// The same for the same seed: 20 to 200 g, 0.04 to 0.4 N of friction, 0.02 to 0.5 N s/m, 3.3 to 20 N, all
/// evenly by their logarithm; up to 0.5 ms of delay; every other one bends by 2 to 20 N/mm.
std::vector<DrawnDevice> draw_devices(const SubjectSet& set, std::size_t count, std::uint32_t seed);

struct DrawnResult {
  DrawnDevice drawn;
  double plain_moves = 0.0, plain_feels = 0.0, growing_moves = 0.0, growing_feels = 0.0;  ///< N/m
  double plain_depth = 0.0, growing_depth = 0.0;  ///< m, of one touch at the plain wall's largest stiffness
  double ratio() const;                           ///< the smaller of the two
};
/// How a wall is set to a device whose largest plain stiffness is known.
struct GrowthRule {
  double touch_share = 0.8;    ///< of what the plain wall allows by both criteria
  double growth_time = 0.2;    ///< s
  double damping_share = 0.1;  ///< of m / T
};
std::vector<DrawnResult> run_drawn_devices(const SubjectSet& set, const std::vector<DrawnDevice>& devices,
                                           const GrowthRule& rule, const StiffnessRun& run);

/// One wall in one situation: the people's mean by the worse of the two criteria, N/m.
struct GrowingResult {
  std::string wall;
  std::vector<TwoMeans> situations;  ///< of growing_situations()
};
std::vector<LoopSetting> growing_situations();
std::vector<GrowingResult> run_growing_walls(const SubjectSet& set, const StiffnessRun& run);
/// A wall that need not come to its stiffness: how stiff it can be set, and what is left of that.
struct SeemingResult {
  std::string wall, calm_by;
  PeopleMean stable;      ///< by both criteria
  double rendered = 0.0;  ///< N/m, with each one's own, mean of all touches
};
std::vector<SeemingResult> run_seeming_walls(const SubjectSet& set, const StiffnessRun& run);
report::Section growing_section(const SubjectSet& set, const std::vector<GrowingResult>& walls,
                                const std::vector<SeemingResult>& seeming);
report::Section drawn_section(const std::vector<DrawnResult>& results);

// --- Rate of the loop, encoder and velocity estimator (loop_rates.cpp) -------------------------------------

/// What counts as unstable decides these numbers more than anything else.
enum class RateMeasure : std::uint8_t {
  moves,  ///< more than three counts peak to peak; a force that swings by many newtons a count passes
  /// More than 1 N of force peak to peak. One count of a wall of 1 N / count length is 1 N: nothing can be
  /// found above 18 N/mm with 0.055 mm and 182 N/mm with 5.5 um, whatever the rate.
  feels
};

struct RateCase {
  double rate = 500.0;          ///< Hz
  double count_length = 55e-6;  ///< m
  double wall_damping = 0.0;    ///< N s/m
  control::VelocityEstimatorKind estimator = control::VelocityEstimatorKind::difference;
  double delay_samples = 0.0;  ///< from the sample to its force
  double delay = 0.0;          ///< s, added to it
  std::string name() const;    ///< without rate and encoder
};
inline constexpr std::array study_rates{500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0};  ///< Hz
/// Every rate with: no damping; a delay of one sample; a delay of 0.5 ms; damping of 2 N s/m with each
/// estimator.
std::vector<RateCase> rate_cases(double count_length);

struct RateResult {
  RateCase setting;
  MaxStiffness moves{}, feels{};
  const MaxStiffness& by(RateMeasure measure) const { return measure == RateMeasure::moves ? moves : feels; }
};
/// The person of the supplied scenes; the force is not clipped, and the stiffness rises by 3 % a step, which
/// is the resolution of the result. `device`: its force limit and delay are not used.
std::vector<RateResult> run_rates(const std::vector<RateCase>& cases, const simulation::DeviceModel& device,
                                  const StiffnessRun& run);
/// A table for each encoder and measure.
report::Section rate_section(const std::vector<RateResult>& results);
/// Stiffness over the rate for one encoder and one measure. Throws plot::FigureError.
report::Picture draw_rates(const std::vector<RateResult>& results, double count_length, RateMeasure measure,
                           const std::filesystem::path& file);

}  // namespace kmax::studies
