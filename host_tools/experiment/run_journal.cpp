#include "host_tools/experiment/run_journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <tuple>
#include <utility>

namespace kmax::experiment {

namespace {
constexpr int format_version = 1;

std::string everything_in(int descriptor) {
  std::string text;
  char piece[65536];
  for (;;) {
    const ssize_t count = pread(descriptor, piece, sizeof piece, static_cast<off_t>(text.size()));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(piece, static_cast<std::size_t>(count));
  }
}

/// "trials was 3 and is 5 now" of the first setting that differs.
std::string difference(const RunJournal::Json& before, const RunJournal::Json& now) {
  for (const auto& [name, value] : now.items()) {
    const auto found = before.find(name);
    if (found == before.end()) return fmt::format("{} was not a setting and is {} now", name, value.dump());
    if (*found != value) return fmt::format("{} was {} and is {} now", name, found->dump(), value.dump());
  }
  for (const auto& [name, value] : before.items()) {
    if (!now.contains(name)) return fmt::format("{} was {} and is no setting now", name, value.dump());
  }
  return {};
}
}  // namespace

void RunJournal::fail(const std::string& what) const {
  throw JournalError(fmt::format("{}: {}", file_.string(), what));
}

RunJournal::RunJournal(std::filesystem::path file, const Json& settings, Begin begin)
    : file_(std::move(file)) {
  // As the file will give them back: a float's text, a key's order.
  const Json wanted = Json::parse(settings.dump(-1, ' ', false, Json::error_handler_t::replace));
  descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail(fmt::format("the journal of the run cannot be opened: {}", std::strerror(errno)));
  try {
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0)
      fail("another program is writing this journal; let it end, or give another --out");
    const std::string text = everything_in(descriptor_);
    if (begin == Begin::resume) {
      read(text, wanted);
    } else if (!text.empty()) {
      std::filesystem::path previous = file_;
      previous += ".previous";
      std::error_code failure;
      std::filesystem::copy_file(file_, previous, std::filesystem::copy_options::overwrite_existing, failure);
      if (failure)
        fail(fmt::format("what is there cannot be kept as {}: {}", previous.string(), failure.message()));
    }
    if (ftruncate(descriptor_, static_cast<off_t>(length_)) != 0)
      fail(fmt::format("cannot be written: {}", std::strerror(errno)));
    if (length_ == 0) write_line({{"journal", format_version}, {"settings", wanted}});
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

RunJournal::~RunJournal() {
  close(descriptor_);
}

void RunJournal::read(const std::string& text, const Json& settings) {
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // torn
    const bool last = end + 1 == text.size();
    const Json line = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                  text.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
    const auto wrong = [&] {
      fail(
          fmt::format("line {} is not of a journal that this program has written; move the file away, or "
                      "begin without --resume",
                      number + 1));
    };
    if (number == 0) {
      const auto version = line.find("journal"), before = line.find("settings");
      if (!line.is_object() || version == line.end() || before == line.end() || !before->is_object()) wrong();
      if (*version != format_version)
        fail(fmt::format("the journal has format {}, this program's is {}; begin without --resume",
                         version->dump(), format_version));
      if (const std::string what = difference(*before, settings); !what.empty())
        fail(
            fmt::format("the journal is of a run with other settings: {}; give the same as then to go on "
                        "with it, or begin without --resume",
                        what));
    } else {
      const auto key = line.find("key"), value = line.find("value");
      const bool good = line.is_object() && key != line.end() && value != line.end() && key->is_string();
      // A machine that lost its power may have left a last line of the right length with nothing in it.
      if (!good && last) break;
      if (!good) wrong();
      done_[key->get<std::string>()] = *value;
    }
    begin = end + 1;
    length_ = begin;
  }
  resumed_ = done_.size();
}

const RunJournal::Json* RunJournal::find(std::string_view key) const {
  const std::lock_guard lock(mutex_);
  const auto found = done_.find(key);
  return found == done_.end() ? nullptr : &found->second;
}

std::size_t RunJournal::size() const {
  const std::lock_guard lock(mutex_);
  return done_.size();
}

void RunJournal::write_line(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = pwrite(descriptor_, text.data() + written, text.size() - written,
                                 static_cast<off_t>(length_ + written));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = errno;
      // Half a line would be taken for a torn one, and the next would follow it.
      // If even this fails, the next line is written over it.
      std::ignore = ftruncate(descriptor_, static_cast<off_t>(length_));
      fail(fmt::format("cannot be written: {}", std::strerror(error)));
    }
    written += static_cast<std::size_t>(count);
  }
  length_ += written;
}

void RunJournal::add(const std::string& key, const Json& value) {
  const std::lock_guard lock(mutex_);
  if (done_.contains(key)) throw std::logic_error(fmt::format("journal: '{}' is done already", key));
  Json line = {{"key", key}, {"value", value}};
  write_line(line);
  // As a resumed run will find it.
  done_[key] = Json::parse(line["value"].dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace kmax::experiment
