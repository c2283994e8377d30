#pragma once

#include <stdexcept>
#include <string>

namespace kmax::cli {

/// What to say when a file cannot be written.
std::runtime_error cannot_write(const std::string& path);

/// Throws cannot_write() before anybody waits for what is to be written. Leaves what is there.
void check_writable(const std::string& path);

}  // namespace kmax::cli
