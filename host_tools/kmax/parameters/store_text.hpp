#pragma once

#include <string>
#include <utility>
#include <vector>

#include "host_tools/device/lock.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

/// What `kmax info` says about the parameter store: labels and sentences. Troubles have lines of their own,
/// and only when there are any.
std::vector<std::pair<std::string, std::string>> store_lines(const device::StoreStatus& status);

/// "1 parameter", "2 parameters".
std::string counted(std::uint32_t count, const std::string& noun);

Json store_json(const device::StoreStatus& status);
Json lock_json(const device::LockStatus& status);

}  // namespace kmax::cli
