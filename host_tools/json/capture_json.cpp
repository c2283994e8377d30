#include "host_tools/json/capture_json.hpp"

#include <algorithm>
#include <map>

namespace kmax::json {

using device::CaptureColumn;
using device::Captured;
using device::CaptureSettings;

std::string heading_of(const CaptureColumn& column) {
  static const std::map<std::string, std::string> endings = {
      {"m", "_m"}, {"m/s", "_m_per_s"}, {"N", "_n"}, {"A", "_a"}, {"V", "_v"}, {"rad", "_rad"}};
  if (column.name.starts_with("duty")) return column.name + "_ratio";
  const auto ending = endings.find(column.unit);
  return ending == endings.end() ? column.name : column.name + ending->second;
}

namespace {
Json column_json(const CaptureColumn& column, bool with_values) {
  double low = 0, high = 0, sum = 0;
  if (!column.values.empty()) {
    const auto [least, most] = std::minmax_element(column.values.begin(), column.values.end());
    low = *least;
    high = *most;
    for (const double value : column.values) sum += value;
    sum /= static_cast<double>(column.values.size());
  }
  Json json = {{"name", column.name}, {"unit", column.unit}, {"heading", heading_of(column)},
               {"minimum", low},      {"maximum", high},     {"mean", sum}};
  if (with_values) json["values"] = column.values;
  return json;
}
}  // namespace

Json capture_json(const Captured& captured, const CaptureSettings& settings, bool with_values) {
  Json columns = Json::array();
  for (const CaptureColumn& column : captured.columns) columns.push_back(column_json(column, with_values));
  return {{"axis", settings.axis},
          {"trigger", std::string(device::name_of(settings.trigger))},
          {"samples", captured.samples()},
          {"trigger_sample", captured.trigger_sample},
          {"first_tick", captured.first_tick},
          {"interval_ticks", captured.interval},
          {"tick_rate_hz", captured.tick_rate},
          {"channels", columns}};
}

}  // namespace kmax::json
