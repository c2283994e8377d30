#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

namespace kmax::experiment {

/// The journal cannot be used: of other settings, in use, damaged, not to be written. The message names the
/// file and what to do.
class JournalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a run has found so far, in a file that only grows: a run that was interrupted, however and wherever,
/// takes what is in it and does the rest.
///
/// Lines of JSON (UTF-8): first {"journal": 1, "settings": {...}}, then {"key": "...", "value": ...} for each
/// job done. A line that has not been finished, because the program ended or the disk was full, counts as not
/// written and is removed; a line that cannot be read anywhere else is an error. What has been added survives
/// the end of the program; the machine's, once the system has written it to the disk.
///
/// The file is locked while it is open (flock): a second program with the same journal is refused. Numbers
/// come back to the last bit; those that are not finite come back as null (JSON has none). add() and find()
/// may be called from several threads.
class RunJournal {
 public:
  using Json = nlohmann::ordered_json;
  enum class Begin {
    fresh,  ///< what is there is kept as FILE.previous, and no job is done yet
    resume  ///< jobs in a file of the same settings are done; no file: none is
  };

  /// `settings`: an object with everything that the results depend on. Throws JournalError; the file is then
  /// as it was.
  RunJournal(std::filesystem::path file, const Json& settings, Begin begin);
  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  /// The value of a job that is done; null if it is not. Stays valid as long as the journal.
  const Json* find(std::string_view key) const;

  /// Jobs done; of those, done before this journal was opened.
  std::size_t size() const;
  std::size_t resumed() const { return resumed_; }

  /// Writes it into the file before it returns. Throws JournalError if that fails (the file is as before),
  /// and std::logic_error for a key that is done.
  void add(const std::string& key, const Json& value);

  const std::filesystem::path& file() const { return file_; }

 private:
  void read(const std::string& text, const Json& settings);
  void write_line(const Json& line);
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t length_ = 0;  ///< of the whole lines
  std::size_t resumed_ = 0;
  mutable std::mutex mutex_;
  std::map<std::string, Json, std::less<>> done_;
};

// What a journal keeps of a touch, its fields and their names written once for both ways:
//
//   constexpr auto fields = [](auto& touch, const auto& field) {
//     field("jitter_m", touch.amplitude);
//     field("aborted", touch.aborted);
//   };
//   void to_json(RunJournal::Json& json, const Touch& touch) { write_fields(json, touch, fields); }
//   void from_json(const RunJournal::Json& json, Touch& touch) { read_fields(json, touch, fields); }

/// Adds the fields, in their order, to what is in `json`: an object, or null, which becomes one. Numbers that
/// are not finite are written as null (run_journal.hpp).
template <typename Value, typename Fields>
void write_fields(RunJournal::Json& json, const Value& value, const Fields& fields) {
  fields(value, [&json](const char* name, const auto& field) { json[name] = field; });
}

/// Other names in `json` are passed over. Throws nlohmann::json::exception, naming what is wrong, for a field
/// that is missing or of another kind; those before it are set then.
template <typename Value, typename Fields>
void read_fields(const RunJournal::Json& json, Value& value, const Fields& fields) {
  fields(value, [&json](const char* name, auto& field) { json.at(name).get_to(field); });
}

}  // namespace kmax::experiment
