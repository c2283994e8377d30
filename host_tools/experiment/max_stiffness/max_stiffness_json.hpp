#pragma once
// A search's result as JSON, for the journal of a run: reads back equal to the last bit.

#include <nlohmann/json.hpp>

#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"

namespace kmax::experiment {

nlohmann::ordered_json json_of(const MaxStiffness& result);

// Throws nlohmann::json::exception for a document that is not one of json_of().
MaxStiffness max_stiffness_from(const nlohmann::ordered_json& document);

}  // namespace kmax::experiment
