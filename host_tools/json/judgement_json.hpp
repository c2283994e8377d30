#pragma once

#include <string>

#include "host_tools/check/judgement.hpp"
#include "host_tools/json/json.hpp"

namespace kmax::json {

/// A judgement as `kmax check --json` shows it; `hand`: the name of whose hand it is.
Json judgement_json(const check::Judgement& judgement, const std::string& hand);

}  // namespace kmax::json
