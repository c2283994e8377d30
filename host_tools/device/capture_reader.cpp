#include "host_tools/device/capture_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "firmware/capture/capture.hpp"
#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/suggestion.hpp"

namespace kmax::device {

using firmware::CaptureChannel;
using firmware::CaptureCommand;
using firmware::CaptureState;
using firmware::CaptureTrigger;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using Phase = CaptureProgress::Phase;

namespace {
constexpr milliseconds capture_poll_interval{20};
// The device acts in its next tick; this is for a line that is slow.
constexpr milliseconds grace{1'000};

CaptureChannel channel_of(std::string_view name) {
  for (const auto& text : firmware::capture_channel_texts) {
    if (text.name == name && text.channel != CaptureChannel::none) return text.channel;
  }
  const auto names = capture_channel_names();
  const std::string meant = base::did_you_mean(name, names);
  throw base::ValueError(
      fmt::format("there is no channel '{}' to capture{}", name,
                  meant.empty() ? fmt::format("; channels are {}", fmt::join(names, ", ")) : meant));
}

/// Checked here against the dictionary, so that a wrong setting is found before anything is sent.
template <firmware::FixedName name>
Assignment assignment(double value) {
  const Parameter parameter = Parameter::of<name>();
  const firmware::Entry& entry = parameter.definition();
  if (!(value >= entry.minimum && value <= entry.maximum))
    throw base::ValueError(
        fmt::format("{}: {} is not allowed; it can be {}", parameter.name(), value, allowed_text(parameter)));
  return {parameter, firmware::raw_from_number(entry.type, value)};
}

std::uint32_t samples_that_fit(const CaptureSettings& settings) {
  return static_cast<std::uint32_t>(firmware::capture_words / settings.channels.size());
}

std::uint32_t samples_of(const CaptureSettings& settings) {
  return settings.samples == 0 ? samples_that_fit(settings) : settings.samples;
}

void check(const CaptureSettings& settings) {
  if (settings.channels.empty() || settings.channels.size() > firmware::capture_channels_max)
    throw base::ValueError(fmt::format("{} channels are to be captured; it can be 1 to {}",
                                       settings.channels.size(), firmware::capture_channels_max));
  for (auto one = settings.channels.begin(); one != settings.channels.end(); ++one) {
    if (std::find(settings.channels.begin(), one, *one) != one)
      throw base::ValueError(fmt::format("the channel {} is named twice; once is enough", *one));
  }
  if (settings.samples > samples_that_fit(settings))
    throw base::ValueError(fmt::format(
        "{} samples of {} channels do not fit into the device's {} values; at most {} do", settings.samples,
        settings.channels.size(), firmware::capture_words, samples_that_fit(settings)));
  if (settings.pre_trigger >= samples_of(settings))
    throw base::ValueError(
        fmt::format("{} samples before the trigger leave none for the trigger's own among {}; at most {} can "
                    "be before it",
                    settings.pre_trigger, samples_of(settings), samples_of(settings) - 1));
}

std::vector<Assignment> assignments_of(const CaptureSettings& settings,
                                       std::vector<CaptureChannel> channels) {
  channels.resize(firmware::capture_channels_max, CaptureChannel::none);
  return {assignment<"capture.axis">(static_cast<double>(settings.axis)),
          assignment<"capture.channel_1">(static_cast<double>(channels[0])),
          assignment<"capture.channel_2">(static_cast<double>(channels[1])),
          assignment<"capture.channel_3">(static_cast<double>(channels[2])),
          assignment<"capture.channel_4">(static_cast<double>(channels[3])),
          assignment<"capture.interval">(settings.interval),
          assignment<"capture.samples">(settings.samples),
          assignment<"capture.pre_trigger">(settings.pre_trigger),
          assignment<"capture.trigger">(static_cast<double>(settings.trigger)),
          assignment<"capture.trigger_level">(settings.level)};
}

void command(Device& device, CaptureCommand what) {
  // Twice does no harm: the capture that nobody has heard of begins again.
  device.write(Parameter::of<"capture.command">(), static_cast<std::uint32_t>(what), true);
}

void report_if_asked(const CaptureReader::ReportProgress& report, const CaptureProgress& progress) {
  if (report) report(progress);
}
}  // namespace

std::vector<std::string> capture_channel_names() {
  std::vector<std::string> names;
  for (const auto& text : firmware::capture_channel_texts) {
    if (text.channel != CaptureChannel::none) names.emplace_back(text.name);
  }
  return names;
}

std::string capture_channel_unit(std::string_view name) {
  return std::string(text_of(channel_of(name)).unit);
}

std::vector<std::string> capture_trigger_names() {
  std::vector<std::string> names;
  for (const auto& trigger : firmware::names::capture_trigger) names.emplace_back(trigger.name);
  return names;
}

std::string_view name_of(CaptureTrigger trigger) {
  return firmware::names::capture_trigger[static_cast<std::size_t>(trigger)].name;
}

CaptureTrigger capture_trigger_of(std::string_view name) {
  for (const auto& trigger : firmware::names::capture_trigger) {
    if (trigger.name == name) return static_cast<CaptureTrigger>(trigger.value);
  }
  throw base::ValueError(fmt::format("there is no trigger '{}'; triggers are {}", name,
                                     fmt::join(capture_trigger_names(), ", ")));
}

const std::vector<double>& Captured::column(std::string_view name) const {
  std::vector<std::string> names;
  for (const CaptureColumn& one : columns) {
    if (one.name == name) return one.values;
    names.push_back(one.name);
  }
  throw base::ValueError(fmt::format("'{}' was not captured, but {}", name, fmt::join(names, ", ")));
}

CaptureReader::~CaptureReader() {
  try {
    if (running_) stop();
  } catch (const std::exception&) {
    // The link is gone; a capture that nobody reads does no harm.
  }
}

void CaptureReader::arm(const CaptureSettings& settings) {
  check(settings);
  std::vector<CaptureChannel> channels;
  for (const std::string& name : settings.channels) channels.push_back(channel_of(name));
  const std::vector<Assignment> assignments = assignments_of(settings, channels);
  count_length_ = device_.count_length(settings.axis);
  channels_ = channels;
  settings_ = settings;
  device_.apply(assignments);
  running_ = true;
  try {
    command(device_, CaptureCommand::arm);
  } catch (const device::RefusedError& error) {
    running_ = false;
    throw base::DeviceError(fmt::format("{}: the capture could not be armed: {}", device_.description(),
                                        refusal_words(device_.last_refusal().reason, error)));
  }
}

void CaptureReader::stop() {
  running_ = false;
  command(device_, CaptureCommand::stop);
}

CaptureReader::Status CaptureReader::status() {
  static constexpr Parameter asked[] = {Parameter::of<"capture.state">(), Parameter::of<"capture.taken">(),
                                        Parameter::of<"capture.trigger_sample">(),
                                        Parameter::of<"capture.first_tick">(),
                                        Parameter::of<"capture.channels">()};
  const auto raw = device_.read(asked);
  return {static_cast<CaptureState>(raw[0]), raw[1], raw[2], raw[3], raw[4]};
}

std::optional<CaptureProgress> CaptureReader::look() {
  const Status now = status();
  if (now.state == CaptureState::complete || now.state == CaptureState::idle) running_ = false;
  if (now.state == CaptureState::complete) return std::nullopt;
  if (now.state == CaptureState::idle)
    throw base::DeviceError(fmt::format(
        "{}: the capture was stopped by another program, or the device restarted", device_.description()));
  return CaptureProgress{now.state == CaptureState::running ? Phase::running : Phase::waiting, now.taken,
                         samples_of(settings_)};
}

void CaptureReader::wait(microseconds patience, const ReportProgress& report) {
  const std::uint32_t all = samples_of(settings_);
  const auto needed = microseconds(static_cast<std::int64_t>(
      std::ceil(1e6 * static_cast<double>(all) * settings_.interval / firmware::tick_rate_hz)));
  auto deadline = device_.link().now() + patience;
  bool triggered = false;
  std::uint32_t taken = 0;
  for (;;) {
    auto progress = look();
    if (!progress) return;
    if (progress->phase == Phase::running && !triggered) {
      triggered = true;
      deadline = device_.link().now() + needed + grace;
    }
    // A virtual board on a busy machine falls behind real time.
    if (std::exchange(taken, progress->done) != progress->done && triggered)
      deadline = std::max(deadline, device_.link().now() + grace);
    if (triggered) progress->phase = Phase::running;
    report_if_asked(report, *progress);
    if (device_.link().now() >= deadline) {
      stop();
      if (!triggered) fail_without_trigger(patience);
      throw base::DeviceError(
          fmt::format("{}: the capture stands still at {} of {} samples: the axis has no ticks",
                      device_.description(), progress->done, all));
    }
    device_.link().wait(std::min<microseconds>(capture_poll_interval, deadline - device_.link().now()));
  }
}

void CaptureReader::fail_without_trigger(microseconds patience) {
  const double seconds = static_cast<double>(patience.count()) * 1e-6;
  std::string level;
  if (settings_.trigger == CaptureTrigger::force) level = fmt::format(" above {} N", settings_.level);
  if (settings_.trigger == CaptureTrigger::velocity) level = fmt::format(" above {} m/s", settings_.level);
  throw base::DeviceError(
      fmt::format("{}: the trigger '{}'{} did not come within {} s; the capture has been stopped",
                  device_.description(), name_of(settings_.trigger), level, seconds));
}

Captured CaptureReader::read(const ReportProgress& report) {
  const Status before = status();
  if (before.state != CaptureState::complete)
    throw base::DeviceError(
        fmt::format("{}: there is no complete capture to read, but one that is {}", device_.description(),
                    firmware::names::capture_state[static_cast<std::size_t>(before.state) %
                                                   std::size(firmware::names::capture_state)]
                        .name));
  const auto taken_away = [this] {
    return base::DeviceError(
        fmt::format("{}: another program has taken the device's capture; try again", device_.description()));
  };
  if (before.channels != channels_.size() || before.taken > samples_of(settings_)) throw taken_away();
  const std::size_t all = std::size_t{before.taken} * before.channels;
  std::vector<std::uint32_t> words;
  try {
    words = device_.link().read_capture(all, [&](std::size_t done) {
      report_if_asked(report,
                      {Phase::reading, static_cast<std::uint32_t>(done), static_cast<std::uint32_t>(all)});
    });
  } catch (const device::RefusedError&) {
    throw taken_away();
  }
  if (status() != before) throw taken_away();

  Captured captured{.first_tick = before.first_tick,
                    .trigger_sample = before.trigger_sample,
                    .interval = settings_.interval,
                    .tick_rate = firmware::tick_rate_hz,
                    .count_length = count_length_};
  for (const CaptureChannel channel : channels_)
    captured.columns.push_back({std::string(text_of(channel).name), std::string(text_of(channel).unit), {}});
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::size_t c = i % channels_.size();
    captured.columns[c].values.push_back(firmware::capture_value(channels_[c], words[i], count_length_));
  }
  return captured;
}

}  // namespace kmax::device
