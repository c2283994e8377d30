#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::bench {

/// Parameters that are changed on a device in RAM, each with the value that it had before the first change,
/// put back however the work on the device ends.
///
/// A change is temporary or a result: put_temporary_back() undoes the ones, put_back() both. What has not
/// been put back or kept when the journal ends is put back then. A text is "NAME=VALUE"; a name without
/// prefix is on the axis. The axis must be disarmed whenever something is put back.
///
/// Errors: base::ValueError, base::DeviceError, device::LinkError. The destructor throws nothing: if it
/// fails, `notice` gets the reason and the former values as NAME=VALUE, to be set by hand.
class Journal {
 public:
  using Notice = std::function<void(const std::string&)>;

  Journal(device::Device& device, std::size_t axis, Notice notice = {})
      : device_(device), axis_(axis), notice_(std::move(notice)) {}
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void set_temporary(const std::vector<std::string>& texts) { set(texts, false); }
  void set_result(const std::vector<std::string>& texts) { set(texts, true); }
  /// Parameters that somebody else is going to change, NAME or NAME=VALUE: put back like a temporary change.
  void note(const std::vector<std::string>& texts);

  /// In one transaction each.
  void put_back();
  void put_temporary_back();
  /// All that has been changed stays; nothing more is put back.
  void forget() { entries_.clear(); }
  /// Whether nothing was changed or noted that has not been put back.
  bool empty() const { return entries_.empty(); }

 private:
  struct Entry {
    device::Assignment before;
    bool result;
  };
  void note(const std::vector<device::Parameter>& parameters);
  void set(const std::vector<std::string>& texts, bool result);
  void put_back(bool results);
  void report(const char* why) const noexcept;

  device::Device& device_;
  std::size_t axis_;
  Notice notice_;
  std::vector<Entry> entries_;
};

}  // namespace kmax::bench
