#pragma once

#include <string>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::calibration {

// Parameters that are changed on a device in RAM, each with the value that it had before the first change.
//
// A change is temporary or a result: put_temporary_back() undoes the ones, put_back() both. What has not been
// put back or kept when the journal ends is put back then. A text is "NAME=VALUE"; a name without prefix is
// on the axis.
//
// Errors: device::ValueError, device::DeviceError, link::LinkError; the destructor swallows them.
class ParameterJournal {
 public:
  ParameterJournal(device::Device& device, std::size_t axis) : device_(device), axis_(axis) {}
  ~ParameterJournal();
  ParameterJournal(const ParameterJournal&) = delete;
  ParameterJournal& operator=(const ParameterJournal&) = delete;

  void set_temporary(const std::vector<std::string>& texts) { set(texts, false); }
  void set_result(const std::vector<std::string>& texts) { set(texts, true); }
  // Parameters that somebody else is going to change: put back like a temporary change.
  void note(const std::vector<std::string>& names);

  // In one transaction each. The axis must be disarmed.
  void put_back();
  void put_temporary_back();
  // All that has been changed stays; nothing more is put back.
  void forget() { entries_.clear(); }

 private:
  struct Entry {
    device::Assignment before;
    bool result;
  };
  void note(const std::vector<device::Parameter>& parameters);
  void set(const std::vector<std::string>& texts, bool result);

  device::Device& device_;
  std::size_t axis_;
  std::vector<Entry> entries_;
};

}  // namespace kmax::calibration
