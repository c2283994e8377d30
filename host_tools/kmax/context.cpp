#include "host_tools/kmax/context.hpp"

#include "host_tools/device/device_address.hpp"

namespace kmax::cli {

std::string Context::device_address() const {
  return device_option.empty() ? link::default_device_address() : device_option;
}

std::vector<std::size_t> Context::axes() const {
  if (axis_option) return {*axis_option};
  std::vector<std::size_t> all;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) all.push_back(axis);
  return all;
}

device::Device Context::connect() {
  const link::Notice notice = [this](const std::string& text) { note(text); };
  auto opened = opener_(device_address(), notice);
  if (simulated())
    note(
        "sim: a fresh simulated device that lives only for this command; --device serial:PATH or KMAX_DEVICE "
        "names a lasting one");
  return device::Device(std::move(opened), notice);
}

void Context::note(const std::string& text) {
  messages_ << "kmax: " << text << std::endl;
}

}  // namespace kmax::cli
