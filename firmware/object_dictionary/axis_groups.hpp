#pragma once

#include "control/haptic_loop.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// Records that exist once per axis. Holding registers for what is set, input registers for what is read.
namespace group {
inline constexpr Group wall{"wall", 0x2000, Scope::axis, 0x0000, true};
inline constexpr Group interference{"interference", 0x2001, Scope::axis, 0x0040, true};
inline constexpr Group position{"position", 0x2002, Scope::axis, 0x0060};
inline constexpr Group velocity{"velocity", 0x2003, Scope::axis, 0x0070};
inline constexpr Group haptic{"haptic", 0x2004, Scope::axis, 0x0080};
inline constexpr Group force{"force", 0x2005, Scope::axis, 0x0090};
inline constexpr Group guard{"guard", 0x2007, Scope::axis, 0x00B0};
inline constexpr Group device{"device", 0x2008, Scope::axis, 0x00D0};
inline constexpr Group motor{"motor", 0x2009, Scope::axis, 0x00E0};
inline constexpr Group current{"current", 0x200A, Scope::axis, 0x0100};
inline constexpr Group encoder{"encoder", 0x200B, Scope::axis, 0x0110};
inline constexpr Group temperature{"temperature", 0x200C, Scope::axis, 0x0130};
inline constexpr Group instability{"instability", 0x200D, Scope::axis, 0x0150};
inline constexpr Group drive{"drive", 0x2010, Scope::axis, 0x0200};
/// Apart from the controlword, so that no write covers both.
inline constexpr Group drive_mode{"drive", 0x2016, Scope::axis, 0x0208, true};
inline constexpr Group drive_status{"drive", 0x2011, Scope::axis, 0x0000};
inline constexpr Group measured{"measured", 0x2012, Scope::axis, 0x0020};
inline constexpr Group excitation{"excitation", 0x2013, Scope::axis, 0x0210, true};
inline constexpr Group compensation{"compensation", 0x2014, Scope::axis, 0x0240};
inline constexpr Group trip{"trip", 0x2015, Scope::axis, 0x0080};
inline constexpr Group profile{"profile", 0x2017, Scope::axis, 0x0280, true};
inline constexpr Group profile_actual{"profile", 0x2018, Scope::axis, 0x00C0};
inline constexpr Group telemetry{"telemetry", 0x2019, Scope::axis, 0x00E0};
inline constexpr Group guard_status{"guard", 0x201A, Scope::axis, 0x0100};
inline constexpr Group instability_status{"instability", 0x201B, Scope::axis, 0x0110};
}  // namespace group

enum class EncoderKind : std::uint8_t { quadrature, as5047p };

/// What each choice is called. The numbers are the enumerations' own, in figures where an enumeration is
/// defined above the dictionary.
namespace names {
template <typename Enumeration>
constexpr NamedValue named(std::string_view name, Enumeration value) {
  return {name, static_cast<std::int32_t>(value)};
}
using namespace control;
inline constexpr NamedValue wall_law[] = {named("none", WallKind::none), named("plain", WallKind::plain),
                                          named("magnetic", WallKind::magnetic),
                                          named("adaptive", WallKind::adaptive)};
inline constexpr NamedValue wall_side[] = {{"-1", -1}, {"+1", 1}};
inline constexpr NamedValue adaptive_relation[] = {named("linear", AdaptiveRelation::linear),
                                                   named("square", AdaptiveRelation::square),
                                                   named("square_root", AdaptiveRelation::square_root)};
inline constexpr NamedValue adaptive_velocity[] = {named("approach", AdaptiveVelocity::approach),
                                                   named("speed", AdaptiveVelocity::speed)};
inline constexpr NamedValue adaptive_mode[] = {named("instant", AdaptiveMode::instant),
                                               named("latched", AdaptiveMode::latched),
                                               named("peak_hold", AdaptiveMode::peak_hold)};
inline constexpr NamedValue interference_mode[] = {named("none", InterferenceMode::none),
                                                   named("perpendicular", InterferenceMode::perpendicular),
                                                   named("parallel", InterferenceMode::parallel)};
inline constexpr NamedValue rounding[] = {named("nearest", Rounding::nearest),
                                          named("floor", Rounding::floor),
                                          named("hysteresis", Rounding::hysteresis)};
inline constexpr NamedValue velocity_estimator[] = {
    named("difference", VelocityEstimatorKind::difference),
    named("low_pass", VelocityEstimatorKind::low_pass),
    named("foaw", VelocityEstimatorKind::foaw),
    named("foaw_end_fit", VelocityEstimatorKind::foaw_end_fit),
    named("tracking", VelocityEstimatorKind::tracking),
    named("edge_period", VelocityEstimatorKind::edge_period)};
// Modes that would remove a danger are listed only when this firmware has them: a guard that is accepted and
// ignored is worse than none.
inline constexpr NamedValue guard_mode[] = {{"off", 0}, {"warn", 1}, {"refuse", 2}};
inline constexpr NamedValue guard_verdict[] = {{"not_judged", 0}, {"pass", 1}, {"fail", 2}};
/// In the numbers of control::Criterion.
inline constexpr NamedValue guard_criterion[] = {
    {"colgate", 0},          {"gil", 1},         {"sampled_eigenvalues", 2},
    {"abbott_okamura", 3},   {"diolaiti", 4},    {"resolution", 5},
    {"resolution_speed", 6}, {"field_slope", 7}, {"saturation_depth", 8}};
inline constexpr NamedValue instability_action[] = {
    named("off", InstabilityAction::off), named("warn", InstabilityAction::warn),
    named("soften", InstabilityAction::soften), named("trip", InstabilityAction::trip)};
inline constexpr NamedValue motor_kind[] = {{"dc", 0}, {"pmsm", 1}};
inline constexpr NamedValue encoder_kind[] = {named("quadrature", EncoderKind::quadrature),
                                              named("as5047p", EncoderKind::as5047p)};
inline constexpr NamedValue encoder_start[] = {{"anywhere", 0}, {"at_rest", 1}};
inline constexpr NamedValue encoder_index[] = {{"none", 0}, {"once_per_turn", 1}};
inline constexpr NamedValue encoder_direction[] = {{"-1", -1}, {"+1", 1}};
inline constexpr NamedValue drive_mode[] = {{"haptic", 0}, {"excitation", 1}, {"torque", 2}};
/// In the numbers of CiA 402, which has no names for them. 10 is cyclic synchronous torque, negative modes
/// are the manufacturer's.
inline constexpr NamedValue operation_mode[] = {{"-1", -1}, {"-2", -2}, {"10", 10}};
inline constexpr NamedValue polarity[] = {{"0", 0}, {"192", 192}};
/// Of CiA 402's options those that a device whose stop is to make no force can have.
inline constexpr NamedValue quick_stop_option[] = {{"0", 0}, {"6", 6}};
inline constexpr NamedValue disable_drive[] = {{"0", 0}};
inline constexpr NamedValue halt_option[] = {{"1", 1}};
inline constexpr NamedValue abort_connection_option[] = {{"1", 1}};
inline constexpr NamedValue presence[] = {{"present", 0}, {"no_answer", 1}, {"declared", 2}};
inline constexpr NamedValue no_or_yes[] = {{"no", 0}, {"yes", 1}};
inline constexpr NamedValue excitation_kind[] = {
    {"off", 0}, {"voltage", 1}, {"current", 2}, {"torque", 3}, {"position", 4}};
inline constexpr NamedValue alternation_axis[] = {{"along", 0}, {"across", 1}};
}  // namespace names

}  // namespace kmax::firmware
