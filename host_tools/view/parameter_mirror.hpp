#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::view {

/// The device's saved kind of parameters as they were last read, kept up to date a request at a time: other
/// programs set parameters too.
class ParameterMirror {
 public:
  /// All of them. Errors as Device.
  void read_all(device::Device& device);

  /// Reads some of those that are shown or that the wall is judged by, all of them in turn. True: something
  /// is not as it was.
  bool read_some(device::Device& device);

  /// They have been set.
  void set(std::span<const device::Assignment> assignments);

  const firmware::ParameterValues& values() const { return values_; }

  /// What a revert goes back to: the values that were found at first, or were last saved.
  const firmware::ParameterValues& found() const { return *found_; }
  void keep() { found_ = values_; }
  /// What of that which is shown has to be set to get back there.
  std::vector<device::Assignment> way_back() const;

 private:
  firmware::ParameterValues values_;
  std::optional<firmware::ParameterValues> found_;
  std::size_t next_ = 0;  ///< of those that read_some() reads
};

}  // namespace kmax::view
