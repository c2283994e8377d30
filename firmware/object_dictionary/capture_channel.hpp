#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// What a capture can record of an axis (firmware/capture/capture.hpp). The numbers are those of
/// capture.channel_1..4: part of the protocol, only ever appended to.
enum class CaptureChannel : std::uint8_t {
  none = 0,
  position = 1,               ///< re-sampled
  velocity = 2,               ///< estimated
  force = 3,                  ///< asked of the device
  count = 4,                  ///< encoder count, offset and direction applied, low 32 bits
  current = 5,                ///< torque-making; DC: (b - c) / 2; stator frame: along the vector
  current_reference = 6,      ///< of `current`
  current_d = 7,              ///< the other component
  current_b = 8,              ///< phase B, positive into the motor
  current_c = 9,              ///< phase C
  voltage = 10,               ///< asked of the bridge, after its limits; the component that drives `current`
  voltage_d = 11,             ///< the other component
  electrical_angle = 12,      ///< of the frame that is in use
  supply = 13,                ///< supply of the power stage
  duty_a = 14,                ///< share of the period with the high side on
  duty_b = 15,                ///< likewise
  duty_c = 16,                ///< likewise
  magnetic_coefficient = 17,  ///< F_MC at work
  distance = 18,              ///< outside the wall; negative inside
  flags = 19,                 ///< capture_flag
};

/// Channels with CaptureChannel::none among them, so that a channel is an index.
inline constexpr std::size_t capture_channel_count = 20;
/// Channels in one capture.
inline constexpr std::size_t capture_channels_max = 4;

/// How a channel's value is kept in its 32-bit word, so that the tick stores what it has: no value is
/// converted, none is rounded.
enum class CaptureEncoding : std::uint8_t {
  real,    ///< float32 in the channel's unit
  whole,   ///< two's complement
  counts,  ///< two's complement, encoder counts; times the handle's travel per count it is in the unit
  turns,   ///< unsigned, 2^32 to a turn; the unit is the radian
  flags,   ///< bits
};

struct CaptureChannelText {
  CaptureChannel channel;
  std::string_view name;
  CaptureEncoding encoding;
  std::string_view unit;  ///< SI; empty: a pure number
};

inline constexpr std::array capture_channel_texts = std::to_array<CaptureChannelText>({
    {CaptureChannel::none, "none", CaptureEncoding::whole, ""},
    {CaptureChannel::position, "position", CaptureEncoding::counts, "m"},
    {CaptureChannel::velocity, "velocity", CaptureEncoding::real, "m/s"},
    {CaptureChannel::force, "force", CaptureEncoding::real, "N"},
    {CaptureChannel::count, "count", CaptureEncoding::whole, "counts"},
    {CaptureChannel::current, "current", CaptureEncoding::real, "A"},
    {CaptureChannel::current_reference, "current_reference", CaptureEncoding::real, "A"},
    {CaptureChannel::current_d, "current_d", CaptureEncoding::real, "A"},
    {CaptureChannel::current_b, "current_b", CaptureEncoding::real, "A"},
    {CaptureChannel::current_c, "current_c", CaptureEncoding::real, "A"},
    {CaptureChannel::voltage, "voltage", CaptureEncoding::real, "V"},
    {CaptureChannel::voltage_d, "voltage_d", CaptureEncoding::real, "V"},
    {CaptureChannel::electrical_angle, "electrical_angle", CaptureEncoding::turns, "rad"},
    {CaptureChannel::supply, "supply", CaptureEncoding::real, "V"},
    {CaptureChannel::duty_a, "duty_a", CaptureEncoding::real, ""},
    {CaptureChannel::duty_b, "duty_b", CaptureEncoding::real, ""},
    {CaptureChannel::duty_c, "duty_c", CaptureEncoding::real, ""},
    {CaptureChannel::magnetic_coefficient, "magnetic_coefficient", CaptureEncoding::real, "N"},
    {CaptureChannel::distance, "distance", CaptureEncoding::real, "m"},
    {CaptureChannel::flags, "flags", CaptureEncoding::flags, ""},
});
static_assert(capture_channel_texts.size() == capture_channel_count);

constexpr const CaptureChannelText& text_of(CaptureChannel channel) {
  return capture_channel_texts[static_cast<std::size_t>(channel)];
}

static_assert(
    [] {
      for (std::size_t i = 0; i < capture_channel_count; ++i) {
        if (static_cast<std::size_t>(capture_channel_texts[i].channel) != i) return false;
      }
      return true;
    }(),
    "capture_channel_texts must follow the enumeration");

/// Bits of CaptureChannel::flags. Bits 0 to 4 are those of measured.flags; the axis' fault stands above.
namespace capture_flag {
inline constexpr std::uint32_t inside = 1u << 0;              ///< the wall
inline constexpr std::uint32_t force_limited = 1u << 1;       ///< by force.limit
inline constexpr std::uint32_t slew_limited = 1u << 2;        ///< by force.slew_limit
inline constexpr std::uint32_t ramping = 1u << 3;             ///< soft start
inline constexpr std::uint32_t armed = 1u << 4;               ///< the axis is driven in this tick
inline constexpr std::uint32_t saturated = 1u << 5;           ///< current or voltage at a limit
inline constexpr std::uint32_t count_valid = 1u << 6;         ///< the encoder answered
inline constexpr std::uint32_t excitation_started = 1u << 7;  ///< a run begins in this tick
inline constexpr unsigned fault_shift = 8;
inline constexpr std::uint32_t fault = 0xFFu << fault_shift;  ///< the Fault's number
}  // namespace capture_flag

/// What starts the part of a capture that is kept; the numbers are those of capture.trigger.
enum class CaptureTrigger : std::uint8_t {
  now = 0,         ///< the first tick
  contact = 1,     ///< the handle comes into the wall
  force = 2,       ///< |force| above the level, N
  velocity = 3,    ///< |velocity| above the level, m/s
  fault = 4,       ///< the axis trips
  excitation = 5,  ///< an excitation starts
};

/// The numbers are those of capture.state.
enum class CaptureState : std::uint8_t {
  idle = 0,      ///< nothing has been captured, or it was stopped before its trigger
  waiting = 1,   ///< armed; keeps the last samples until the trigger
  running = 2,   ///< triggered; fills up
  complete = 3,  ///< can be read
};

/// The numbers are those of capture.command.
enum class CaptureCommand : std::uint8_t { stop = 0, arm = 1 };

namespace names {
/// An array that a function can return, made from the table above.
struct CaptureChannelNames {
  NamedValue list[capture_channel_count];
};
inline constexpr CaptureChannelNames capture_channel_names = [] {
  CaptureChannelNames names{};
  for (std::size_t i = 0; i < capture_channel_count; ++i)
    names.list[i] = {capture_channel_texts[i].name, static_cast<std::int32_t>(i)};
  return names;
}();
inline constexpr const NamedValue (&capture_channel)[capture_channel_count] = capture_channel_names.list;
inline constexpr NamedValue capture_trigger[] = {{"now", 0},      {"contact", 1}, {"force", 2},
                                                 {"velocity", 3}, {"fault", 4},   {"excitation", 5}};
inline constexpr NamedValue capture_state[] = {{"idle", 0}, {"waiting", 1}, {"running", 2}, {"complete", 3}};
inline constexpr NamedValue capture_command[] = {{"stop", 0}, {"arm", 1}};
}  // namespace names

/// A word as a number in the channel's unit. `count_length`: m per encoder count. Outside the interrupt.
constexpr double capture_value(CaptureChannel channel, std::uint32_t word, double count_length) {
  constexpr double turn = 6.283185307179586476925;
  switch (text_of(channel).encoding) {
    case CaptureEncoding::real:
      return static_cast<double>(std::bit_cast<float>(word));
    case CaptureEncoding::counts:
      return static_cast<double>(static_cast<std::int32_t>(word)) * count_length;
    case CaptureEncoding::turns:
      return static_cast<double>(word) * (turn / 4294967296.0);
    case CaptureEncoding::whole:
      return static_cast<double>(static_cast<std::int32_t>(word));
    case CaptureEncoding::flags:
      break;
  }
  return static_cast<double>(word);
}

}  // namespace kmax::firmware
