#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/lines/gpio_lines.hpp"

namespace kmax::lines {

/// A computer with GPIO lines: remembers who holds what and every level in order.
class FakeGpio {
 public:
  struct Line {
    bool high = false;  ///< the pull while nobody drives
    bool pulled_high = false;
    bool output = false;
    std::string consumer;
  };

  std::map<std::string, Line> lines;  ///< by text_of()
  std::vector<std::string> history;   ///< "gpiochip0 line 17 low", "... released"
  std::deque<Edge> edges;             ///< given to the watcher one by one
  std::function<void()> at_wait = [] {};
  std::vector<LineSettings> watched;
  std::string broken;  ///< this line cannot be requested

  std::unique_ptr<GpioLines> open();

  Line& line(const LineSettings& settings) {
    if (text_of(settings) == broken) throw LineError(broken + ": Device or resource busy");
    return lines[text_of(settings)];
  }
  void level(const LineSettings& settings, bool active) {
    const bool high = active == (settings.polarity == Polarity::active_high);
    line(settings).high = high;
    history.push_back(text_of(settings) + (high ? " high" : " low"));
  }
};

namespace fake {
class Output final : public OutputLine {
 public:
  Output(FakeGpio& gpio, LineSettings settings, bool active) : gpio_(gpio), settings_(std::move(settings)) {
    FakeGpio::Line& line = gpio_.line(settings_);
    if (!line.consumer.empty()) throw LineError(text_of(settings_) + ": held by " + line.consumer);
    line.consumer = "kmax";
    line.output = true;
    gpio_.level(settings_, active);
  }
  ~Output() override {
    FakeGpio::Line& line = gpio_.line(settings_);
    line.consumer.clear();
    line.output = false;
    line.high = line.pulled_high;
    gpio_.history.push_back(text_of(settings_) + " released");
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  void set(bool active) override { gpio_.level(settings_, active); }

 private:
  FakeGpio& gpio_;
  LineSettings settings_;
};

class Watch final : public EdgeWatch {
 public:
  explicit Watch(FakeGpio& gpio) : gpio_(gpio) {}
  std::vector<bool> states() override {
    std::vector<bool> found;
    for (const LineSettings& one : gpio_.watched)
      found.push_back(gpio_.line(one).high == (one.polarity == Polarity::active_high));
    return found;
  }
  std::vector<Edge> wait(std::chrono::milliseconds) override {
    gpio_.at_wait();
    if (gpio_.edges.empty()) return {};
    const Edge first = gpio_.edges.front();
    gpio_.edges.pop_front();
    return {first};
  }

 private:
  FakeGpio& gpio_;
};

class Lines final : public GpioLines {
 public:
  explicit Lines(FakeGpio& gpio) : gpio_(gpio) {}
  LineFacts describe(const LineSettings& settings) override {
    const FakeGpio::Line& line = gpio_.line(settings);
    LineFacts facts;
    facts.chip = "gpiochip7";
    facts.label = "fake";
    facts.offset = settings.offset.value_or(42);
    facts.name = settings.name;
    facts.consumer = line.consumer;
    facts.output = line.output;
    if (!line.consumer.empty()) return facts;
    facts.high = line.high;
    facts.active = line.high == (settings.polarity == Polarity::active_high);
    return facts;
  }
  std::unique_ptr<OutputLine> drive(const LineSettings& settings, bool active) override {
    return std::make_unique<Output>(gpio_, settings, active);
  }
  std::unique_ptr<EdgeWatch> watch(std::span<const LineSettings> settings) override {
    gpio_.watched.assign(settings.begin(), settings.end());
    for (const LineSettings& one : settings) gpio_.line(one);
    return std::make_unique<Watch>(gpio_);
  }

 private:
  FakeGpio& gpio_;
};
}  // namespace fake

inline std::unique_ptr<GpioLines> FakeGpio::open() {
  return std::make_unique<fake::Lines>(*this);
}

}  // namespace kmax::lines
