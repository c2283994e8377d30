#include "host_tools/bring_up/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host_tools/base/files.hpp"

namespace kmax::bring_up {

using Json = nlohmann::ordered_json;
using selftest::CheckResult;
using selftest::MeasuredValue;
using selftest::Verdict;

bool StageResult::passed() const {
  return std::none_of(checks.begin(), checks.end(),
                      [](const CheckResult& check) { return check.verdict == Verdict::fail; });
}

BoardFacts read_board(device::Device& device) {
  const auto raw = [&device](const device::Parameter& parameter) { return device.read(parameter); };
  BoardFacts board;
  board.serial_number = raw(device::Parameter::of<"info.serial_number">());
  board.firmware = raw(device::Parameter::of<"info.firmware_version">());
  board.dictionary = raw(device::Parameter::of<"info.dictionary_checksum">());
  const auto texts = device.identify();
  if (const auto found = texts.find("model_name"); found != texts.end()) board.board = found->second;
  return board;
}

const StageResult* Report::result(std::size_t axis, Stage stage) const {
  for (const Entry& entry : entries_) {
    if (entry.axis == axis && entry.result.stage == stage) return &entry.result;
  }
  return nullptr;
}

bool Report::passed(std::size_t axis, Stage stage) const {
  const StageResult* found = result(axis, stage);
  return found != nullptr && found->passed();
}

std::optional<Stage> Report::next(std::size_t axis) const {
  for (const StageText& text : all_stages()) {
    if (!passed(axis, text.stage)) return text.stage;
  }
  return std::nullopt;
}

void Report::add(std::size_t axis, StageResult result) {
  std::erase_if(entries_, [&](const Entry& entry) {
    return entry.axis == axis &&
           (entry.result.stage == result.stage || (!result.passed() && entry.result.stage > result.stage));
  });
  entries_.push_back({axis, std::move(result)});
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return std::pair(a.axis, a.result.stage) < std::pair(b.axis, b.result.stage);
  });
}

std::optional<double> Report::number(std::size_t axis, Stage stage, const std::string& check,
                                     const std::string& name) const {
  const StageResult* found = result(axis, stage);
  if (found == nullptr) return std::nullopt;
  for (const CheckResult& one : found->checks) {
    if (one.name != check) continue;
    for (const MeasuredValue& value : one.values) {
      if (value.name == name) return value.value;
    }
  }
  return std::nullopt;
}

namespace {
/// JSON has no infinity and no NaN.
Json number_json(double number) {
  return std::isfinite(number) ? Json(number) : Json(nullptr);
}

double number_of(const Json& json, double otherwise) {
  return json.is_null() ? otherwise : json.get<double>();
}

Json check_json(const CheckResult& check) {
  Json values = Json::array();
  for (const MeasuredValue& value : check.values)
    values.push_back({{"name", value.name},
                      {"value", number_json(value.value)},
                      {"unit", value.unit},
                      {"least", number_json(value.least)},
                      {"most", number_json(value.most)}});
  return {{"name", check.name},
          {"verdict", selftest::name_of(check.verdict)},
          {"message", check.message},
          {"part", check.part},
          {"values", values}};
}

Verdict verdict_of(const std::string& name) {
  for (const Verdict verdict : {Verdict::pass, Verdict::fail, Verdict::not_judged}) {
    if (name == selftest::name_of(verdict)) return verdict;
  }
  throw ReportError(fmt::format("'{}' is no verdict", name));
}

CheckResult check_of(const Json& json) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  CheckResult check{json.at("name").get<std::string>(),
                    verdict_of(json.at("verdict").get<std::string>()),
                    json.at("message").get<std::string>(),
                    {},
                    json.at("part").get<std::string>()};
  for (const Json& value : json.at("values"))
    check.values.push_back({value.at("name").get<std::string>(),
                            number_of(value.at("value"), std::numeric_limits<double>::quiet_NaN()),
                            value.at("unit").get<std::string>(), number_of(value.at("least"), -infinity),
                            number_of(value.at("most"), infinity)});
  return check;
}
}  // namespace

std::string Report::text() const {
  Json stages = Json::array();
  for (const auto& [axis, result] : entries_) {
    Json checks = Json::array();
    for (const CheckResult& check : result.checks) checks.push_back(check_json(check));
    stages.push_back({{"axis", axis},
                      {"stage", std::string(text_of(result.stage).name)},
                      {"passed", result.passed()},
                      {"time", result.time},
                      {"checks", checks}});
  }
  const Json document = {{"bring_up", 1},
                         {"board",
                          {{"serial_number", board_.serial_number},
                           {"name", board_.board},
                           {"firmware_version", board_.firmware},
                           {"dictionary_checksum", board_.dictionary}}},
                         {"stages", stages}};
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Report Report::parse(const std::string& text) {
  try {
    const Json document = Json::parse(text);
    if (document.at("bring_up").get<int>() != 1)
      throw ReportError("it is of another version of this program");
    const Json& board = document.at("board");
    Report report({board.at("serial_number").get<std::uint32_t>(), board.at("name").get<std::string>(),
                   board.at("firmware_version").get<std::uint32_t>(),
                   board.at("dictionary_checksum").get<std::uint32_t>()});
    for (const Json& one : document.at("stages")) {
      const auto stage = stage_named(one.at("stage").get<std::string>());
      if (!stage) throw ReportError(fmt::format("there is no stage {}", one.at("stage").dump()));
      StageResult result{*stage, one.at("time").get<std::string>(), {}};
      for (const Json& check : one.at("checks")) result.checks.push_back(check_of(check));
      const auto axis = one.at("axis").get<std::size_t>();
      if (axis >= firmware::axis_count) throw ReportError(fmt::format("there is no axis {}", axis));
      report.add(axis, std::move(result));
    }
    return report;
  } catch (const Json::exception& error) {
    throw ReportError(error.what());
  }
}

Report open_report(const std::filesystem::path& file, const BoardFacts& board) {
  if (!std::filesystem::exists(file)) return Report(board);
  const auto advice = "give another file with --report, or move this one away";
  const std::string text = base::text_of<ReportError>(file, advice);
  try {
    Report before = Report::parse(text);
    if (before.board().serial_number != board.serial_number)
      throw ReportError(fmt::format("it is about the board with serial number {}, and this one has {}",
                                    before.board().serial_number, board.serial_number));
    Report report(board);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      for (const StageText& stage : all_stages()) {
        if (const StageResult* result = before.result(axis, stage.stage)) report.add(axis, *result);
      }
    }
    return report;
  } catch (const ReportError& error) {
    throw ReportError(
        fmt::format("{}: not a report of this board: {}; {}", file.string(), error.what(), advice));
  }
}

}  // namespace kmax::bring_up
