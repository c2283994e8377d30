#include "host_tools/view/server/messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>

#include "firmware/parameters/refusal.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/check/criterion_text.hpp"
#include "host_tools/device/guard_words.hpp"
#include "host_tools/json/capture_json.hpp"
#include "host_tools/json/drive_json.hpp"
#include "host_tools/json/judgement_json.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/view/server/access.hpp"
#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::view {

using device::Parameter;
using firmware::DriveState;
using json::Json;

namespace {
/// Texts from outside may be no UTF-8, which JSON is.
std::string text_of(const Json& document) {
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string to_string(const AxisState& axis) {
  if (axis.presence != firmware::AxisPresence::present) return device::presence_words(axis.presence);
  switch (axis.status.state()) {
    case DriveState::operation_enabled:
      return "Armed: force is on";
    case DriveState::quick_stop_active:
      return "Stopped: the force is off";
    case DriveState::fault:
    case DriveState::fault_reaction_active:
      return "Fault: the force is off";
    default:
      return "Disarmed";
  }
}

/// What to look at, besides the state.
std::string trouble_of(const AxisState& axis) {
  if (axis.status.faulty()) return axis.status.fault_words();
  const std::string check = device::guard_words(axis.guard);
  if (axis.status.armed()) return check.empty() ? "" : "stability check: " + check;
  if (axis.status.refusal == firmware::Refusal::guard_refused && !check.empty())
    return "the last attempt to arm was refused: stability check: " + check;
  if (axis.status.refusal != firmware::Refusal::none)
    return fmt::format("the last attempt to arm was refused: {}", firmware::to_string(axis.status.refusal));
  return {};
}

Json or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

/// Five digits: a screen has fewer points.
Json rounded(const std::vector<double>& numbers) {
  Json list = Json::array();
  for (const double number : numbers) list.push_back(std::stod(fmt::format("{:.5g}", number)));
  return list;
}

Json outlines_json(const std::vector<plot::Outline>& outlines) {
  Json all = Json::array();
  for (const plot::Outline& outline : outlines) all.push_back({rounded(outline.x), rounded(outline.y)});
  return all;
}

Json side_json(const check::MapAxis& side) {
  return {{"name", side.parameter.name()},
          {"unit", std::string(side.parameter.definition().unit)},
          {"from", side.from},
          {"to", side.to},
          {"logarithmic", side.logarithmic}};
}

/// With as many digits as it has; JSON has no NaN and no infinity.
template <typename Number>
void append_number(std::string& text, Number number) {
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(number)) {
      text += "null";
      return;
    }
    fmt::format_to(std::back_inserter(text), "{:.{}g}", number, std::is_same_v<Number, double> ? 9 : 6);
  } else {
    fmt::format_to(std::back_inserter(text), "{}", number);
  }
}

template <typename Value>
void append_list(std::string& text, const char* name, std::span<const record::Row> rows, Value value) {
  fmt::format_to(std::back_inserter(text), ",\"{}\":[", name);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i != 0) text += ',';
    append_number(text, value(rows[i]));
  }
  text += ']';
}
}  // namespace

Message welcome(ClientId client) {
  return {.text = text_of(
              {{"type", "welcome"}, {"protocol", std::string(Access::protocol)}, {"client", client}})};
}

Message reply(const Json& id, bool ok, const std::string& text, ClientId to) {
  return {.text = text_of({{"type", "reply"}, {"id", id}, {"ok", ok}, {"message", text}}), .to = to};
}

const std::vector<Parameter>& shown_parameters() {
  static const std::vector<Parameter> all = [] {
    std::vector<Parameter> shown;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      for (const Parameter& one :
           {Parameter::of<"wall.law">(axis), Parameter::of<"wall.stiffness">(axis),
            Parameter::of<"wall.damping">(axis), Parameter::of<"wall.magnetic_coefficient">(axis),
            Parameter::of<"wall.magnetic_length">(axis), Parameter::of<"wall.position">(axis),
            Parameter::of<"wall.side">(axis), Parameter::of<"haptic.rate">(axis),
            Parameter::of<"wall.stiffness_ceiling">(axis), Parameter::of<"wall.damping_ceiling">(axis),
            Parameter::of<"force.limit">(axis), Parameter::of<"force.ceiling">(axis),
            Parameter::of<"guard.damping">(axis), Parameter::of<"guard.friction">(axis)})
        shown.push_back(one);
    }
    return shown;
  }();
  return all;
}

Message device_message(const DeviceFacts& facts) {
  Json parameters = Json::object();
  for (const Parameter& one : shown_parameters()) {
    const Json whole = json::description_json(one);
    Json description;
    for (const char* key :
         {"unit", "min", "max", "default", "values", "change_while_armed", "ceiling", "help"})
      description[key] = whole[key];
    parameters[one.name()] = description;
  }
  Json channels = Json::array();
  for (const std::string& name : device::capture_channel_names())
    channels.push_back({{"name", name}, {"unit", device::capture_channel_unit(name)}});
  Json triggers = Json::array();
  for (const auto& trigger : firmware::names::capture_trigger) triggers.push_back(std::string(trigger.name));
  Json procedures = Json::array();
  for (const ProcedureText& one : procedure_texts())
    procedures.push_back({{"name", std::string(one.name)},
                          {"title", std::string(one.title)},
                          {"before", std::string(one.before)},
                          {"hand", or_null(std::string(one.hand))},
                          {"trials", one.trials == 0 ? Json(nullptr) : Json(one.trials)}});
  return {.text = text_of({{"type", "device"},
                           {"address", facts.address},
                           {"version", facts.version},
                           {"program", facts.program},
                           {"identification", facts.identification},
                           {"axes", firmware::axis_count},
                           {"tick_rate_hz", firmware::tick_rate_hz},
                           {"counted_rows", facts.counted_rows},
                           {"hand", facts.hand},
                           {"flags", record::flag_texts()},
                           {"capture", {{"channels", channels}, {"triggers", triggers}}},
                           {"procedures", procedures},
                           {"parameters", parameters}}),
          .key = "device"};
}

Message state_message(const LinkState& link, std::span<const AxisState> axes,
                      const std::optional<device::StoreStatus>& store) {
  Json list = Json::array();
  for (const AxisState& axis : axes) {
    Json one = json::status_json(axis.axis, axis.presence, axis.status, axis.guard);
    one["words"] = to_string(axis);
    one["trouble"] = or_null(trouble_of(axis));
    one["armed_by"] = axis.armed_by ? Json(*axis.armed_by) : Json(nullptr);
    list.push_back(one);
  }
  return {.text = text_of({{"type", "state"},
                           {"link",
                            {{"connected", link.connected},
                             {"trouble", or_null(link.trouble)},
                             {"round_trip_s", link.round_trip},
                             {"rows_trouble", or_null(link.rows_trouble)}}},
                           {"unsaved", store ? Json(store->unsaved_parameters) : Json(nullptr)},
                           {"axes", list}}),
          .key = "state"};
}

Message stopped_message(const StopReport& report) {
  return {.text = text_of({{"type", "stopped"},
                           {"why", report.why},
                           {"seconds", report.seconds},
                           {"trouble", or_null(report.trouble)},
                           {"time", std::chrono::duration<double>(report.time.time_since_epoch()).count()}}),
          .key = "stopped"};
}

Message parameters_message(const firmware::ParameterValues& values, const firmware::ParameterValues& revert) {
  Json list = Json::object();
  for (const Parameter& one : shown_parameters()) {
    Json value = json::value_and_unit_json(one, values.raw(one.slot()));
    value["revert"] = json::value_json(one, revert.raw(one.slot()));
    list[one.name()] = value;
  }
  return {.text = text_of({{"type", "parameters"}, {"values", list}}), .key = "parameters"};
}

Message rows_message(std::uint64_t first_row, std::span<const record::Row> rows,
                     const std::optional<record::Losses>& losses) {
  // Written by hand: a thousand rows a second.
  std::string text = fmt::format("{{\"type\":\"rows\",\"first_row\":{},\"lost\":{}", first_row,
                                 losses ? fmt::format("{}", losses->rows) : "null");
  append_list(text, "tick", rows, [](const record::Row& row) { return row.tick; });
  text += ",\"axes\":[";
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    fmt::format_to(std::back_inserter(text), "{}{{\"axis\":{}", axis == 0 ? "" : ",", axis);
    const auto of = [axis](auto member) {
      return [axis, member](const record::Row& row) { return row.axes[axis].*member; };
    };
    append_list(text, "position", rows, of(&record::AxisSample::position));
    append_list(text, "velocity", rows, of(&record::AxisSample::velocity));
    append_list(text, "force", rows, of(&record::AxisSample::force));
    append_list(text, "current", rows, of(&record::AxisSample::current));
    append_list(text, "flags", rows, of(&record::AxisSample::flags));
    text += '}';
  }
  return {.text = text + "]}", .may_be_dropped = true};
}

Message curve_message(const firmware::ParameterValues& values, std::size_t axis) {
  const wall::ForceCurve at_rest = wall::force_curve(values, axis, 0);
  Json curve = {{"type", "curve"},
                {"axis", axis},
                {"distance_m", rounded(at_rest.distance)},
                {"force_n", rounded(at_rest.force)},
                {"approaching_force_n", nullptr}};
  const auto law = values.choice<control::WallKind, "wall.law">(axis);
  if (control::follows_velocity(law))
    curve["approaching_force_n"] = rounded(wall::force_curve(values, axis, 0.5).force);
  return {.text = text_of(curve), .key = fmt::format("curve {}", axis)};
}

Message judgement_message(const check::Judgement& judgement, const std::string& hand, std::size_t axis) {
  Json document = {{"type", "judgement"}, {"axis", axis}};
  const Json judged = json::judgement_json(judgement, hand);
  for (const auto& [key, value] : judged.items()) document[key] = value;
  return {.text = text_of(document), .key = fmt::format("judgement {}", axis)};
}

Message map_message(const check::StabilityMap& map, std::size_t axis) {
  const check::MapOutlines outlines = check::outlines_of(map);
  Json bounds = Json::array();
  for (const auto& [criterion, strokes] : outlines.bounds) {
    const check::CriterionText& text = check::text_of(criterion);
    bounds.push_back({{"criterion", std::string(text.name())},
                      {"worth", std::string(check::name_of(text.worth))},
                      {"strokes", outlines_json(strokes)}});
  }
  return {.text = text_of({{"type", "map"},
                           {"axis", axis},
                           {"right", side_json(map.x)},
                           {"up", side_json(map.y)},
                           {"all_met", outlines_json(outlines.all_met)},
                           {"unstable", outlines_json(outlines.unstable)},
                           {"bounds", bounds}}),
          .key = fmt::format("map {} {}", axis, map.y.parameter.name())};
}

Message procedure_message(const ProcedureState& state) {
  static constexpr const char* phases[] = {"none",      "running", "passed",    "failed",
                                           "cancelled", "stopped", "broken off"};
  Json findings = Json::array();
  for (const Finding& one : state.findings)
    findings.push_back({{"name", one.name}, {"verdict", one.verdict}, {"words", one.words}});
  return {.text = text_of({{"type", "procedure"},
                           {"name", state.name},
                           {"title", state.title},
                           {"axis", state.axis},
                           {"client", state.client},
                           {"phase", phases[static_cast<std::size_t>(state.phase)]},
                           {"progress", or_null(state.progress)},
                           {"instruction", or_null(state.instruction)},
                           {"prompt", state.waits ? Json(state.prompt_number) : Json(nullptr)},
                           {"words", or_null(state.words)},
                           {"findings", findings},
                           {"notes", state.notes},
                           {"changed", state.changed}}),
          .key = "procedure"};
}

Message capture_progress(std::string_view phase, std::uint32_t done, std::uint32_t all) {
  return {.text = text_of({{"type", "capture"}, {"phase", std::string(phase)}, {"done", done}, {"all", all}}),
          .key = "capture"};
}

Message capture_failed(const std::string& why) {
  return {.text = text_of({{"type", "capture"}, {"phase", "failed"}, {"message", why}}), .key = "capture"};
}

Message capture_message(const device::Captured& captured, const device::CaptureSettings& settings) {
  Json document = {{"type", "capture"}, {"phase", "complete"}};
  const Json taken = json::capture_json(captured, settings, true);
  for (const auto& [key, value] : taken.items()) document[key] = value;
  return {.text = text_of(document), .key = "capture"};
}

}  // namespace kmax::view
