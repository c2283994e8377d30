#pragma once
// What a journal keeps of a touch, its fields and their names written once for both ways:
//
//   constexpr auto fields = [](auto& touch, const auto& field) {
//     field("jitter_m", touch.amplitude);
//     field("aborted", touch.aborted);
//   };
//   void to_json(RunJournal::Json& json, const Touch& touch) { write_fields(json, touch, fields); }
//   void from_json(const RunJournal::Json& json, Touch& touch) { read_fields(json, touch, fields); }

#include "host_tools/experiment/run_journal.hpp"

namespace kmax::experiment {

/// Adds the fields, in their order, to what is in `json`: an object, or null, which becomes one. Numbers that
/// are not finite are written as null (run_journal.hpp).
template <typename Value, typename Fields>
void write_fields(RunJournal::Json& json, const Value& value, const Fields& fields) {
  fields(value, [&json](const char* name, const auto& field) { json[name] = field; });
}

/// Other names in `json` are passed over. Throws nlohmann::json::exception, naming what is wrong, for a field
/// that is missing or of another kind; those before it are set then.
template <typename Value, typename Fields>
void read_fields(const RunJournal::Json& json, Value& value, const Fields& fields) {
  fields(value, [&json](const char* name, auto& field) { json.at(name).get_to(field); });
}

}  // namespace kmax::experiment
