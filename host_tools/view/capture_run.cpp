#include "host_tools/view/capture_run.hpp"

#include "host_tools/base/errors.hpp"
#include "host_tools/view/force_removal.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

using device::CaptureProgress;

namespace {
constexpr std::chrono::milliseconds interval{50};

std::string_view name_of(CaptureProgress::Phase phase) {
  switch (phase) {
    case CaptureProgress::Phase::waiting:
      return "waiting";
    case CaptureProgress::Phase::running:
      return "running";
    case CaptureProgress::Phase::reading:
      break;
  }
  return "reading";
}
}  // namespace

void CaptureRun::begin(const device::CaptureSettings& settings) {
  reader_.reset();
  reader_.emplace(device_);
  settings_ = settings;
  try {
    reader_->arm(settings);
  } catch (...) {
    reader_.reset();
    throw;
  }
  next_look_ = {};
}

void CaptureRun::end(const std::string& why) {
  if (!reader_) return;
  reader_.reset();
  publish_(capture_failed(why));
}

void CaptureRun::look() {
  const auto now = std::chrono::steady_clock::now();
  if (!reader_ || now < next_look_) return;
  next_look_ = now + interval;
  const auto show = [this](const CaptureProgress& progress) {
    publish_(capture_progress(name_of(progress.phase), progress.done, progress.all));
  };
  try {
    const auto progress = reader_->look();
    if (progress) return show(*progress);
    publish_(capture_message(reader_->read(show), settings_));
  } catch (const device::LinkError&) {
    reader_.reset();
    throw;
  } catch (const ForceRemoved& removed) {
    publish_(capture_failed(removed.what()));
    reader_.reset();
    throw;
  } catch (const std::exception& error) {
    publish_(capture_failed(error.what()));
  }
  reader_.reset();
}

}  // namespace kmax::view
