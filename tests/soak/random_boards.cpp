// Boards as they come: parts drawn at random from what they are known or guessed to be, each calibrated,
// tested, pressed against walls while it warms up, stopped and saved. Nothing may trip without a cause, and
// nothing that must may fail to. The same seed draws the same boards.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/calibration/procedure.hpp"
#include "host_tools/device/store.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::soak {
namespace {

using simulation::Scene;
using tests::ImageBench;

/// One board, by its number.
class Draw {
 public:
  Draw(unsigned seed, unsigned number) : random_(seed * 100'003U + number) {}

  Scene board() {
    const auto& scenes = host_tools_test::motor_scenes;
    Scene scene = selftest::TestedAxis::opened(scenes[random_() % std::size(scenes)], false);
    scene.seed = random_();
    simulation::SceneAxis& axis = scene.axes[0];
    simulation::CurrentSensorConfig& sensor = axis.current_sensor;
    sensor.offset_b = between(-0.03, 0.03);
    sensor.offset_c = between(-0.03, 0.03);
    sensor.noise = between(2e-6, 10e-6);
    // As current_sensor.hpp has the worst board.
    sensor.drift_b = between(-15e-6, 15e-6);
    sensor.drift_c = between(-15e-6, 15e-6);
    sensor.driven_b = between(-0.1e-3, 0.1e-3);
    sensor.driven_c = between(-0.1e-3, 0.1e-3);
    sensor.gain_error_b = between(-0.03, 0.03);
    sensor.gain_error_c = between(-0.03, 0.03);
    sensor.settling *= between(0.8, 1.2);
    sensor.filter *= between(0.8, 1.2);
    if (scene.supply) {
      scene.supply->voltage *= between(0.9, 1.03);
      scene.supply->resistance *= between(0.5, 3.0);
      scene.supply->capacitance *= between(0.7, 1.3);
    }
    axis.device.mass *= between(0.8, 1.3);
    axis.device.damping *= between(0.5, 2.0);
    axis.device.friction *= between(0.5, 1.5);
    // On lines that only the virtual board has: the image meets them.
    simulation::SpikesConfig& spikes = scene.spikes.emplace();
    spikes.width = between(50e-9, 1e-6);
    spikes.rate = between(10.0, 300.0);
    spikes.at_samples = random_() % 2 == 0;
    return scene;
  }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967295.0;
  }

 private:
  std::mt19937 random_;
};

struct ForceError {
  double sum = 0.0, worst = 0.0;
  unsigned windows = 0;

  void add(double error) {
    sum += std::abs(error);
    worst = std::max(worst, std::abs(error));
    ++windows;
  }
  double mean() const { return windows == 0 ? 0.0 : sum / windows; }
};

[[noreturn]] void wrong(const std::string& what) {
  throw std::runtime_error(what);
}

/// N. The image's error has the cogging in it.
struct AllowedError {
  double mean, worst;
};
constexpr AllowedError allowed_natively{0.1, 0.15}, allowed_on_image{0.3, 0.3};

void judge(const ForceError& error, const AllowedError& allowed) {
  if (!(error.mean() <= allowed.mean && error.worst <= allowed.worst))
    wrong(fmt::format("force error {:.3f} N mean, {:.3f} N worst; allowed are {:.2f} and {:.2f} N",
                      error.mean(), error.worst, allowed.mean, allowed.worst));
}

/// A hand that leans on the handle for two seconds and lets go for one, with another force each time.
double hand_force(double seconds, double most) {
  const double turn = std::floor(seconds / 3.0);
  return seconds - 3.0 * turn < 2.0 ? -most * (0.3 + 0.7 * std::fmod(0.618 * (turn + 1.0), 1.0)) : 0.3 * most;
}

class NativeRun {
 public:
  NativeRun(const Scene& scene, double contact, double hottest)
      : board_(scene, 0), contact_(contact), hottest_(hottest) {}

  void run() {
    calibrate();
    test();
    for (const char* law : {"plain", "adaptive"}) press(law);
    stop();
    save();
    throw_it();  // last: a synchronous motor's angle is in doubt behind it
  }
  /// At both walls.
  const ForceError& error() const { return error_; }

 private:
  device::Device& device() { return *board_.device; }
  simulation::MotorDrive& drive() { return board_.drives().drive(0); }
  device::Drive axis() { return {device(), 0}; }
  void set(const std::vector<std::string>& texts) { device().apply(device::parse_assignments(texts)); }
  void wait(double seconds) {
    board_.link->wait(std::chrono::microseconds(std::llround(seconds * 20e3) * 50));
  }

  void calibrate() {
    const auto report = calibration::calibrate(device(), {}, nullptr, [](const std::string&) {});
    for (const calibration::StepReport& step : report.steps) {
      if (step.failure) wrong(fmt::format("calibrate: {}: {}", step.name, step.failure->words));
    }
  }
  /// Up to three times, as the guided start does: a handle that friction held beside a detent of the motor's
  /// cogging is shaken loose by the pulses, and finds its place.
  void test() {
    for (int tries = 1;; ++tries) {
      const selftest::Report report = board_.run();
      const selftest::CheckResult* failure = report.first_failure();
      if (failure == nullptr) return;
      if (failure->part != "handle" || tries == 3)
        wrong(fmt::format("self-test: {}: {}", failure->part, failure->message));
      wait(1.0);
    }
  }

  /// Half of the contact, while the board warms up.
  void press(const std::string& law) {
    const double here = device().read_number("measured.position");
    set({"wall.law=" + law, fmt::format("wall.position={:.5f}", here - 0.003), "wall.stiffness=800",
         "wall.damping=0", "wall.side=1", "force.ramp_time=0.05", "link.timeout=0"});
    axis().arm();
    const double half = contact_ / 2.0;
    double time = 0.0, error = 0.0;
    unsigned ticks = 0;
    const unsigned windows = error_.windows;
    bool stood = false;
    board_.link->before_tick = [&] {
      time += 50e-6;
      drive().push(hand_force(time, 1.5), 8.0);
      const firmware::AxisReport report = board_.link->application().ISR_report(0);
      // Cogging is no error of the force that is made.
      error += drive().force() - cogging() - static_cast<double>(report.force);
      if (++ticks < 400) return;
      const double share = (law == "plain" ? 0.0 : 0.5) + 0.5 * std::min(1.0, time / half);
      drive().current_sensor().set_temperature(25.0 + share * (hottest_ - 25.0));
      const bool stands = report.haptic.inside && std::abs(drive().handle().velocity()) < 1e-4;
      if (stands && stood) error_.add(error / ticks);
      stood = stands;
      error = 0.0;
      ticks = 0;
    };
    for (double done = 0.0; done < half; done += 3.0) {
      wait(std::min(3.0, half - done));
      const auto status = axis().status();
      if (!status.armed()) wrong(fmt::format("{} wall, {:.0f} s: {}", law, done, status.fault_words()));
    }
    board_.link->before_tick = nullptr;
    drive().push(0.0, 8.0);
    axis().disarm();
    if (error_.windows == windows) wrong(law + " wall: the handle stood nowhere inside it");
  }
  double cogging() {
    const auto* motor = drive().synchronous_motor();
    return motor == nullptr
               ? 0.0
               : motor->cogging_torque(drive().shaft_angle()) / drive().encoder().config().transmission;
  }

  /// In front of the wall, where nothing pushes.
  void arm() {
    drive().push(0.5, 20.0);
    wait(1.0);
    drive().push(0.0, 8.0);
    wait(0.2);
    axis().arm();
  }
  void expect_trip(firmware::Fault cause, const char* what, double within) {
    wait(within);
    const auto status = axis().status();
    if (status.armed() || device::fault_of(status) != cause)
      wrong(fmt::format("{}: state {}, {}", what, device::to_string(status.state()), status.fault_words()));
  }
  void stop() {
    arm();
    wait(0.1);
    board_.link->hardware().power().press_emergency_stop(true);
    expect_trip(firmware::Fault::emergency_stop, "the emergency stop", 0.001);
    board_.link->hardware().power().press_emergency_stop(false);
    wait(0.05);
    axis().clear();
  }
  /// Out of the wall, with more than device.hand_force.
  void throw_it() {
    arm();
    drive().push(20.0, 0.0);
    expect_trip(firmware::Fault::spin_out, "a throw", 0.012);
  }
  /// Until the flash has been erased once more.
  void save() {
    const double before = device().read_number("store.erases");
    for (int i = 0; i < 40 && device().read_number("store.erases") == before; ++i) {
      set({fmt::format("wall.stiffness={}", 500 + i)});
      device::Store(device()).save();
    }
    arm();
    wait(0.1);
    if (!axis().status().armed()) wrong("not armed after a save: " + axis().status().fault_words());
    axis().disarm();
  }

  selftest::TestedAxis board_;
  double contact_, hottest_;
  ForceError error_;
};

/// The image with the same parts, told of its motor: pressed for as long.
ForceError run_image(Scene scene, double contact, double hottest) {
  scene.identified = true;
  const std::pair<const char*, simulation::ParameterValue> settings[] = {
      {"wall.law", std::string("adaptive")},
      {"wall.position", -0.003},
      {"wall.stiffness", 800.0},
      {"encoder.start", std::string("at_rest")},
      {"link.timeout", 0.0}};
  for (const auto& [name, value] : settings) scene.parameters.push_back({name, value, "random_boards"});
  ImageBench bench(scene);
  bench.start();
  simulation::MotorDrive& drive = bench.world.drive(0);
  bench.master->arm(0);
  ForceError error;
  const double steps = contact / 0.02;
  for (double step = 0.0; step < steps; ++step) {
    drive.push(hand_force(step * 0.02, 1.5), 8.0);
    drive.current_sensor().set_temperature(25.0 + step / steps * (hottest - 25.0));
    bench.board->run_for(0.02);
    // Interference takes it away for some microseconds.
    if (!bench.board->bridge_armed(0)) bench.board->run_for(20e-6);
    if (!bench.board->bridge_armed(0))
      wrong(fmt::format("image, {:.1f} s: {}", step * 0.02, text_of(bench.fault(0)).what));
    const double depth = -0.003 - drive.handle().position();
    if (depth > 1e-4 && std::abs(drive.handle().velocity()) < 1e-4)
      error.add(drive.force() - static_cast<double>(std::bit_cast<float>(bench.number("measured.force"))));
  }
  if (error.windows == 0) wrong("image: the handle stood nowhere inside the wall");
  return error;
}

/// Of one board, natively or on the image; N.
struct Result {
  bool on_image;
  unsigned number;
  std::string motor;
  double mean, worst;

  std::string line() const {
    return fmt::format("{}{:4} {:14} {:.4f} N mean, {:.4f} N worst", on_image ? "image " : "", number, motor,
                       mean, worst);
  }
  /// Nothing for any other line, such as a failure's.
  static std::optional<Result> of(const std::string& line) {
    Result result{line.starts_with("image "), 0, std::string(32, '\0'), 0.0, 0.0};
    const char* text = line.c_str() + (result.on_image ? 6 : 0);
    if (std::sscanf(text, "%u %31s %lf N mean, %lf N worst", &result.number, result.motor.data(),
                    &result.mean, &result.worst) != 4)
      return std::nullopt;
    result.motor.resize(std::strlen(result.motor.c_str()));
    return result;
  }
};

struct Options {
  unsigned boards = 200, first = 0, seed = 1, on_image = 0;
  double contact = 600.0;
  std::string results;
};

/// What has been measured; in a file too, if there is one, for a run that goes on or is shared.
class Results {
 public:
  /// std::runtime_error: the file is of another run, or cannot be written.
  explicit Results(const Options& options) {
    if (options.results.empty()) return;
    const std::string heading = fmt::format("seed {}, {} s of contact", options.seed, options.contact);
    std::ifstream in(options.results);
    bool begun = false;
    for (std::string line; std::getline(in, line);) {
      if (!begun && line != heading)
        throw std::runtime_error(
            fmt::format("{} begins with '{}', and this run's would with '{}': name another", options.results,
                        line, heading));
      begun = true;
      if (const auto result = Result::of(line)) all_.push_back(*result);
    }
    file_.open(options.results, std::ios::app);
    if (!begun) file_ << heading << std::endl;
    if (!file_) throw std::runtime_error(options.results + " cannot be written");
  }
  const Result* find(bool on_image, unsigned number) const {
    const auto found = std::ranges::find_if(
        all_, [&](const Result& r) { return r.on_image == on_image && r.number == number; });
    return found == all_.end() ? nullptr : &*found;
  }
  /// The line and its end in one piece: others may write too.
  const Result* add(const Result& result) {
    if (file_.is_open()) file_ << result.line() + "\n" << std::flush;
    return &all_.emplace_back(result);
  }

 private:
  std::deque<Result> all_;
  std::ofstream file_;
};

/// A line of the table in docs/random_boards.md.
struct Row {
  unsigned boards = 0;
  double sum = 0.0, worst = 0.0;

  void add(const Result& result) {
    ++boards;
    sum += result.mean;
    worst = std::max(worst, result.worst);
  }
  void print(const std::string& what) const {
    if (boards > 0) fmt::print("| {} | {} | {:.3f} N | {:.3f} N |\n", what, boards, sum / boards, worst);
  }
};

int run(const Options& options) {
  Results results(options);
  unsigned failures = 0;
  // What is in the file has not failed.
  const auto measured = [&](bool on_image, unsigned number) -> const Result* {
    if (const Result* known = results.find(on_image, number)) return known;
    Draw draw(options.seed, number);
    const Scene scene = draw.board();
    // It warms up by a degree in a second at most.
    const double hottest = std::min(draw.between(35.0, 70.0), 25.0 + options.contact);
    const Result* result = nullptr;
    try {
      ForceError error;
      if (on_image) {
        error = run_image(scene, std::min(options.contact, 20.0), 45.0);
      } else {
        NativeRun native(scene, options.contact, hottest);
        native.run();
        error = native.error();
      }
      judge(error, on_image ? allowed_on_image : allowed_natively);
      result = results.add({on_image, number, scene.name, error.mean(), error.worst});
      fmt::print("{}\n", result->line());
    } catch (const std::exception& error) {
      ++failures;
      fmt::print("{}{:4} {:14} FAILED {}\n", on_image ? "image " : "", number, scene.name, error.what());
    }
    std::fflush(stdout);
    return result;
  };
  std::vector<Result> natively;
  for (unsigned number = options.first; number < options.first + options.boards; ++number)
    if (const Result* result = measured(false, number)) natively.push_back(*result);
  std::ranges::stable_sort(natively, std::greater{}, &Result::worst);
  Row all, image;
  std::map<std::string, Row> motors;
  for (const Result& result : natively) {
    all.add(result);
    motors[result.motor].add(result);
  }
  const std::size_t most = std::min<std::size_t>(options.on_image, natively.size());
  for (std::size_t i = 0; i < most; ++i)
    if (const Result* result = measured(true, natively[i].number)) image.add(*result);
  fmt::print("\n| motor | boards | force error, mean | worst |\n|---|---|---|---|\n");
  for (const auto& [motor, row] : motors) row.print(motor);
  all.print("all");
  image.print(fmt::format("the worst {}, on the image, cogging counted", most));
  fmt::print("\n{} boards, {} failures\n", options.boards, failures);
  return failures == 0 && !natively.empty() ? 0 : 1;
}

constexpr const char* usage =
    "usage: random_boards [--boards N] [--first B] [--seed S] [--contact SECONDS] [--image N]\n"
    "                     [--results FILE]\n"
    "  --boards N  200 by default, from board B on; --contact 600 s each, half of it at each of two walls\n"
    "  --image N   the N worst of them, 20 s each at most, by the image on the virtual board; 0 by default\n"
    "  --results FILE  keeps what is measured, and measures only what it does not have: a run that was\n"
    "      broken off goes on, and several that began with other boards end as one\n"
    "Exit code 0: no false trip and none missed, and forces within their bounds; 1: else, which the same "
    "seed\n"
    "does again; 2: wrong usage.\n";

template <typename Number>
bool parse(const char* text, Number& number) {
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, number);
  return error == std::errc{} && stop == end && number >= Number{};
}

}  // namespace
}  // namespace kmax::soak

int main(int count, char** arguments) {
  using namespace kmax::soak;
  Options options;
  for (int i = 1; i < count; i += 2) {
    const std::string name = arguments[i];
    const char* value = i + 1 < count ? arguments[i + 1] : "";
    const bool taken = name == "--boards"    ? parse(value, options.boards)
                       : name == "--first"   ? parse(value, options.first)
                       : name == "--seed"    ? parse(value, options.seed)
                       : name == "--contact" ? parse(value, options.contact)
                       : name == "--image"   ? parse(value, options.on_image)
                       : name == "--results" ? !(options.results = value).empty()
                                             : false;
    if (!taken) {
      fmt::print(stderr, "random_boards: '{}' '{}' is not understood\n{}", name, value, usage);
      return 2;
    }
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "random_boards: {}\n", error.what());
    return 2;
  }
}
