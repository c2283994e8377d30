#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

#include "host_tools/flash/flash_image.hpp"
#include "host_tools/flash/flash_plan.hpp"
#include "host_tools/flash/program.hpp"

// Carries a plan out and judges it by what was read back.

namespace kmax::flash {

/// It did not work. The message says what failed, what state the board is in, and shows the end of the log.
class FlashError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct FlashHooks {
  std::function<void(const std::string&)> say = [](const std::string&) {};
  std::function<bool()> stop = [] { return false; };
  ProgramLimits limits{};
};

struct FlashReport {
  std::uint32_t image_crc, parameters_crc;  ///< of what was read from the board
};

/// A folder for the files of one run. Gone afterwards unless kept.
class WorkFolder {
 public:
  WorkFolder();
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path log() const { return path_ / "log.txt"; }
  void keep() { keep_ = true; }

 private:
  std::filesystem::path path_;
  bool keep_ = false;
};

/// Writes the image's files into the folder, runs the plan's steps and compares what came back, byte by byte
/// and by its CRC-32, with the image, and the parameter sectors with what they were before. After a failure
/// the folder is kept. FlashError, ProgramError.
FlashReport write_and_verify(const FlashPlan& plan, const FlashImage& image, WorkFolder& folder,
                             const FlashHooks& hooks);

/// Runs the steps of plan_factory_reset() and makes sure that every byte of the parameter sectors is erased.
/// FlashError, ProgramError.
void erase_parameters(const FlashPlan& plan, WorkFolder& folder, const FlashHooks& hooks);

/// The plan's start steps. FlashError says what has been achieved all the same.
void start_application(const FlashPlan& plan, WorkFolder& folder, const FlashHooks& hooks);

}  // namespace kmax::flash
