// The only file that knows libgpiod (1.6, C++). For version 2 this file is rewritten.

#include <fmt/format.h>

#include <poll.h>
#include <algorithm>
#include <cerrno>
#include <gpiod.hpp>
#include <system_error>

#include "host_tools/lines/gpio_lines.hpp"

namespace kmax::lines {

namespace {

constexpr const char* consumer = "kmax";

std::string advice(int error) {
  switch (error) {
    case EBUSY:
      return "; another program holds it, 'gpioinfo' shows which";
    case EACCES:
    case EPERM:
      return "; the device file belongs to another user: join the group 'gpio', add a udev rule or run as "
             "root";
    case ENOENT:
    case ENODEV:
      return "; 'gpiodetect' lists the chips there are";
    case ENXIO:
    case ENOTSUP:
      return "; the chip does not support this on that line";
    default:
      return "";
  }
}

[[noreturn]] void fail(const std::string& what, const std::system_error& error) {
  throw LineError(fmt::format("{}: {}{}", what, error.code().message(), advice(error.code().value())));
}

gpiod::chip open_chip(const std::string& text) {
  try {
    return gpiod::chip(text);
  } catch (const std::system_error& error) {
    fail(fmt::format("GPIO chip '{}' cannot be opened", text), error);
  }
}

gpiod::line find(const LineSettings& settings) {
  gpiod::line line;
  try {
    if (settings.offset) {
      const gpiod::chip chip = open_chip(settings.chip);
      if (*settings.offset >= chip.num_lines())
        throw LineError(fmt::format("{}: the chip has the lines 0 to {}", text_of(settings),
                                    static_cast<int>(chip.num_lines()) - 1));
      return chip.get_line(*settings.offset);
    }
    line = settings.chip.empty() ? gpiod::find_line(settings.name)
                                 : open_chip(settings.chip).find_line(settings.name);
  } catch (const std::system_error& error) {
    fail(text_of(settings), error);
  }
  if (!line)
    throw LineError(
        fmt::format("{}: there is no line of this name; 'gpioinfo' lists the names", text_of(settings)));
  return line;
}

std::bitset<32> polarity_flag(const LineSettings& settings) {
  return settings.polarity == Polarity::active_low ? gpiod::line_request::FLAG_ACTIVE_LOW : std::bitset<32>();
}

std::bitset<32> bias_flag(const LineSettings& settings) {
  switch (settings.bias) {
    case Bias::pull_up:
      return gpiod::line_request::FLAG_BIAS_PULL_UP;
    case Bias::pull_down:
      return gpiod::line_request::FLAG_BIAS_PULL_DOWN;
    case Bias::disabled:
      return gpiod::line_request::FLAG_BIAS_DISABLE;
    case Bias::as_is:
      break;
  }
  return {};
}

std::bitset<32> drive_flag(const LineSettings& settings) {
  switch (settings.drive) {
    case Drive::open_drain:
      return gpiod::line_request::FLAG_OPEN_DRAIN;
    case Drive::open_source:
      return gpiod::line_request::FLAG_OPEN_SOURCE;
    case Drive::push_pull:
      break;
  }
  return {};
}

class HeldOutput final : public OutputLine {
 public:
  HeldOutput(const LineSettings& settings, bool active) : text_(text_of(settings)), line_(find(settings)) {
    try {
      line_.request({consumer, gpiod::line_request::DIRECTION_OUTPUT,
                     polarity_flag(settings) | bias_flag(settings) | drive_flag(settings)},
                    active ? 1 : 0);
    } catch (const std::system_error& error) {
      fail(fmt::format("{} cannot be made an output", text_), error);
    }
  }
  ~HeldOutput() override {
    try {
      line_.release();
    } catch (const std::exception&) {  // the chip may have been unplugged
    }
  }
  HeldOutput(const HeldOutput&) = delete;
  HeldOutput& operator=(const HeldOutput&) = delete;

  void set(bool active) override {
    try {
      line_.set_value(active ? 1 : 0);
    } catch (const std::system_error& error) {
      fail(fmt::format("{} cannot be set", text_), error);
    }
  }

 private:
  std::string text_;
  gpiod::line line_;
};

class HeldInputs final : public EdgeWatch {
 public:
  explicit HeldInputs(std::span<const LineSettings> settings) {
    for (const LineSettings& one : settings) {
      gpiod::line line = find(one);
      try {
        line.request({consumer, gpiod::line_request::EVENT_BOTH_EDGES, polarity_flag(one) | bias_flag(one)});
        lines_.push_back(line);
        descriptors_.push_back({line.event_get_fd(), POLLIN, 0});
      } catch (const std::system_error& error) {
        fail(fmt::format("{} cannot be watched", text_of(one)), error);
      }
    }
  }
  ~HeldInputs() override {
    for (gpiod::line& line : lines_) {
      try {
        line.release();
      } catch (const std::exception&) {
      }
    }
  }
  HeldInputs(const HeldInputs&) = delete;
  HeldInputs& operator=(const HeldInputs&) = delete;

  std::vector<bool> states() override {
    std::vector<bool> found;
    try {
      for (const gpiod::line& line : lines_) found.push_back(line.get_value() != 0);
    } catch (const std::system_error& error) {
      fail("a watched line cannot be read", error);
    }
    return found;
  }

  std::vector<Edge> wait(std::chrono::milliseconds at_most) override {
    const int ready = poll(descriptors_.data(), descriptors_.size(), static_cast<int>(at_most.count()));
    if (ready < 0 && errno != EINTR)
      throw LineError(fmt::format("waiting for edges: {}", std::generic_category().message(errno)));
    std::vector<Edge> edges;
    if (ready <= 0) return edges;
    try {
      for (std::size_t i = 0; i < lines_.size(); ++i) {
        if (descriptors_[i].revents == 0) continue;
        if ((descriptors_[i].revents & POLLIN) == 0)
          throw LineError("a watched line is gone; was its chip unplugged?");
        for (const gpiod::line_event& event : lines_[i].event_read_multiple())
          edges.push_back({i, event.event_type == gpiod::line_event::RISING_EDGE, event.timestamp});
      }
    } catch (const std::system_error& error) {
      fail("an edge cannot be read", error);
    }
    std::ranges::stable_sort(edges, {}, &Edge::time);
    return edges;
  }

 private:
  std::vector<gpiod::line> lines_;
  std::vector<pollfd> descriptors_;
};

class KernelLines final : public GpioLines {
 public:
  LineFacts describe(const LineSettings& settings) override {
    gpiod::line line = find(settings);
    LineFacts facts;
    try {
      facts.chip = line.get_chip().name();
      facts.label = line.get_chip().label();
      facts.offset = line.offset();
      facts.name = line.name();
      facts.consumer = line.consumer();
      facts.output = line.direction() == gpiod::line::DIRECTION_OUTPUT;
      if (line.is_used()) {
        if (facts.consumer.empty()) facts.consumer = "the kernel";
        return facts;
      }
    } catch (const std::system_error& error) {
      fail(text_of(settings), error);
    }
    // A request as it is takes no pull and no direction.
    try {
      line.request({consumer, gpiod::line_request::DIRECTION_AS_IS, {}});
      facts.high = line.get_value() != 0;
      facts.active = *facts.high == (settings.polarity == Polarity::active_high);
      line.release();
    } catch (const std::system_error& error) {
      fail(fmt::format("{} cannot be read", text_of(settings)), error);
    }
    return facts;
  }

  std::unique_ptr<OutputLine> drive(const LineSettings& settings, bool active) override {
    return std::make_unique<HeldOutput>(settings, active);
  }

  std::unique_ptr<EdgeWatch> watch(std::span<const LineSettings> settings) override {
    return std::make_unique<HeldInputs>(settings);
  }
};

}  // namespace

std::unique_ptr<GpioLines> kernel_gpio_lines() {
  return std::make_unique<KernelLines>();
}

std::string text_of(const LineSettings& settings) {
  if (settings.offset) return fmt::format("{} line {}", settings.chip, *settings.offset);
  if (settings.chip.empty()) return fmt::format("line \"{}\"", settings.name);
  return fmt::format("{} line \"{}\"", settings.chip, settings.name);
}

}  // namespace kmax::lines
