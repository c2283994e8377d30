#include "firmware/canopen/emergency.hpp"

namespace kmax::firmware::canopen {

bool Emergency::raise(const EmergencyError& error) {
  if (find(error.code, error.manufacturer[0]) != present_) return true;
  if (error.code == 0 || present_ == present_error_count) return false;
  errors_[present_++] = error;
  remember(error);
  announce();
  return true;
}

}  // namespace kmax::firmware::canopen
