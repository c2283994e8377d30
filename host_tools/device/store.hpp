#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware/parameters/parameter_keeper.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::device {

/// What a device says about its parameter store; read in one request, so it belongs together.
struct StoreStatus {
  firmware::StoreState state{};
  std::uint32_t sequence = 0;            ///< of the newest record
  std::uint32_t saved_parameters = 0;    ///< in it; 0: nothing has been saved
  std::uint32_t unsaved_parameters = 0;  ///< differ from it, or from the defaults if there is none
  std::uint32_t free_saves = 0, erases = 0, write_errors = 0, damaged_records = 0;
  std::uint32_t migrated_dropped = 0, migrated_defaulted = 0;
  std::vector<std::uint32_t> first_dropped, first_defaulted;  ///< firmware::ParameterIdentity::word()
};

/// A stored parameter by its identity: its name if this program knows it, else its place in the dictionary.
std::string name_of_identity(std::uint32_t identity);

/// All parameters that save keeps.
std::vector<Parameter> persistent_parameters();

/// Keeping parameters over a restart.
/// Errors: DeviceError with the reason in words, device::LinkError.
class Store {
 public:
  explicit Store(Device& device) : device_(device) {}

  StoreStatus status();

  /// Saves all persistent parameters and waits until the device has read them back. If the answer to the
  /// request is lost, the device's own numbers tell whether it was carried out. Returns the state after.
  StoreStatus save();

  struct Change {
    Parameter parameter;
    std::uint32_t before;
  };
  /// Sets all persistent parameters to their defaults, without saving them, and reads them back. The link
  /// follows unit and baud rate. Returns those that were something else.
  std::vector<Change> set_defaults();

 private:
  void command(firmware::StoreCommand command, const char* what);
  StoreStatus wait_until_done(const StoreStatus& before);

  Device& device_;
};

}  // namespace kmax::device
