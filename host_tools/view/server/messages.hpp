#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/check/stability_map.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/record/recording.hpp"
#include "host_tools/view/server/message.hpp"
#include "host_tools/view/server/procedure_text.hpp"

namespace kmax::view {

// Every message there is, as docs/view.md explains it. Numbers are in SI units.

Message welcome(ClientId client);
Message reply(const json::Json& id, bool ok, const std::string& text, ClientId to = 0);

/// What the page shows and sets of each axis.
const std::vector<device::Parameter>& shown_parameters();

struct DeviceFacts {
  std::string address{}, version{};
  std::string program{};  ///< with its commit, and the image that comes with it
  std::map<std::string, std::string> identification{};
  bool counted_rows = false;  ///< rows are due at fixed times, so that a lost one is known
  std::string hand{};
};
Message device_message(const DeviceFacts& facts);

struct AxisState {
  std::size_t axis = 0;
  firmware::AxisPresence presence{};
  device::DriveStatus status{};
  firmware::GuardFinding guard{};
  std::optional<ClientId> armed_by{};
};
struct LinkState {
  bool connected = false;
  std::string trouble{};       ///< why not
  double round_trip = 0;       ///< s, of the last request
  std::string rows_trouble{};  ///< why no rows come
};
Message state_message(const LinkState& link, std::span<const AxisState> axes,
                      const std::optional<device::StoreStatus>& store);

/// How a stop, or what is as urgent, ended.
struct StopReport {
  std::string why{};
  double seconds = 0;     ///< from when it was asked for until the device had answered
  std::string trouble{};  ///< empty: no axis makes force
  std::chrono::system_clock::time_point time = std::chrono::system_clock::now();
};
Message stopped_message(const StopReport& report);

/// `revert`: what a revert would set them to.
Message parameters_message(const firmware::ParameterValues& values, const firmware::ParameterValues& revert);

/// `first_row` counts from 0 since the connection to the device was made.
Message rows_message(std::uint64_t first_row, std::span<const record::Row> rows,
                     const std::optional<record::Losses>& losses);

Message curve_message(const firmware::ParameterValues& values, std::size_t axis);
Message judgement_message(const check::Judgement& judgement, const std::string& hand, std::size_t axis);
Message map_message(const check::StabilityMap& map, std::size_t axis);

/// A procedure, from its start on.
struct ProcedureState {
  enum class Phase : std::uint8_t {
    none,
    running,
    passed,
    failed,
    cancelled,   ///< somebody asked for its end
    stopped,     ///< the force was taken
    broken_off,  ///< the device or the link
  };
  std::string name{}, title{};
  std::size_t axis = 0;
  ClientId client = 0;  ///< who has started it
  Phase phase = Phase::none;
  std::string progress{};
  std::string instruction{};  ///< what somebody is to do
  bool waits = false;         ///< until that has been answered, as prompt_number
  std::uint32_t prompt_number = 0;
  std::string words{};  ///< of its end
  std::vector<Finding> findings{};
  std::vector<std::string> notes{};
  std::size_t changed = 0;  ///< parameters, which can still be put back
};
Message procedure_message(const ProcedureState& state);

Message capture_progress(std::string_view phase, std::uint32_t done, std::uint32_t all);
Message capture_failed(const std::string& why);
Message capture_message(const device::Captured& captured, const device::CaptureSettings& settings);

}  // namespace kmax::view
