#pragma once
// The sections of docs/speed_and_error.md. Each measures, draws its picture into `pictures` and says in words
// what is compared with what.

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/report/page.hpp"

namespace kmax::benchmark {

report::Section integrator_section(const std::filesystem::path& pictures);
/// With the controller, as far as a largest stiffness needs it.
report::Section controller_section();
/// RK4 against the exact method with shared matrices, 500 Hz, forces given: the fewest steps per tick with
/// which it errs as little.
struct EqualError {
  std::string trial;
  double steps = 0.0, factor = 0.0;  // the exact method is so much faster
  bool reached = false;
};
std::vector<EqualError> rk4_at_equal_error();
report::Section scene_section();
report::Section velocity_section(const std::filesystem::path& pictures);
report::Section sine_section(const std::filesystem::path& pictures);
report::Section square_root_section(const std::filesystem::path& pictures);
report::Section field_section(const std::filesystem::path& pictures);
report::Section tick_section(const std::filesystem::path& pictures);
// ns of one HapticLoop<float>::tick() here, with the adaptive wall and FOAW, as the image's budget has them.
double native_haptic_tick();
// `budget`: what `kmax-board ELF --budget --json` printed. Throws std::runtime_error if it is something else.
report::Section image_section(const std::filesystem::path& budget);

}  // namespace kmax::benchmark
