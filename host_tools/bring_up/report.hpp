#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/bring_up/stages.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/selftest/checks.hpp"

namespace kmax::bring_up {

/// What one stage found, in the form of the self-test's checks: each number with the range it should be in.
struct StageResult {
  Stage stage = Stage::logic;
  std::string time;  ///< when it ended, as ISO 8601
  std::vector<selftest::CheckResult> checks;

  /// No check failed.
  bool passed() const;
};

/// Which board it is about.
struct BoardFacts {
  std::uint32_t serial_number = 0;
  std::string board;             ///< its name, by the link's device identification
  std::uint32_t firmware = 0;    ///< info.firmware_version
  std::uint32_t dictionary = 0;  ///< info.dictionary_checksum

  friend bool operator==(const BoardFacts&, const BoardFacts&) = default;
};

BoardFacts read_board(device::Device& device);

/// The report file: the last result of each stage, of each axis of one board.
class Report {
 public:
  explicit Report(BoardFacts board) : board_(std::move(board)) {}

  const BoardFacts& board() const { return board_; }
  /// Nothing if the stage has not been done.
  const StageResult* result(std::size_t axis, Stage stage) const;
  bool passed(std::size_t axis, Stage stage) const;
  /// The first that has not passed; nothing if all have.
  std::optional<Stage> next(std::size_t axis) const;
  /// In the place of an earlier one. What came after a stage that fails no longer counts, and is dropped.
  void add(std::size_t axis, StageResult result);
  /// The number that a check measured before.
  std::optional<double> number(std::size_t axis, Stage stage, const std::string& check,
                               const std::string& name) const;

  std::string text() const;
  /// Throws ReportError, saying where, for what is no such report.
  static Report parse(const std::string& text);

 private:
  struct Entry {
    std::size_t axis;
    StageResult result;
  };

  BoardFacts board_;
  std::vector<Entry> entries_;  ///< by axis and stage
};

class ReportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The report of this board in `file`, or an empty one if there is none. Throws ReportError for a report of
/// another board, and for a file that is no report: neither is written over.
Report open_report(const std::filesystem::path& file, const BoardFacts& board);

}  // namespace kmax::bring_up
