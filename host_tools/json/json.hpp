#pragma once

#include <nlohmann/json.hpp>

namespace kmax::json {

/// Keys stay in the order they are added.
using Json = nlohmann::ordered_json;

}  // namespace kmax::json
