#include "host_tools/record/recording.hpp"

#include <stdexcept>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::record {

namespace {
void write(std::ostream& out, const std::string& line) {
  out << line << std::flush;
  if (!out) throw std::runtime_error("the recording cannot be written; is the disk full or the pipe closed?");
}
}  // namespace

double RecordingProgress::seconds() const {
  return static_cast<double>(last_tick - first_tick) / firmware::tick_rate_hz;
}

double RecordingProgress::rate() const {
  return last_tick == first_tick ? 0 : static_cast<double>(rows - 1) / seconds();
}

void record(RowSource& source, std::ostream& out, const RowCsv& csv, std::optional<double> seconds,
            const std::function<bool(const RecordingProgress&)>& stop, RecordingProgress& progress) {
  write(out, csv.heading());
  while (!stop(progress)) {
    const std::optional<Row> row = source.next(std::chrono::milliseconds(50));
    progress.losses = source.losses();
    if (!row) continue;
    if (progress.rows == 0) progress.first_tick = progress.last_tick = row->tick;
    const double past = static_cast<double>(row->tick - progress.first_tick) / firmware::tick_rate_hz;
    if (seconds && past >= *seconds) return;
    write(out, csv.line(*row, progress.first_tick));
    ++progress.rows;
    progress.last_tick = row->tick;
  }
}

}  // namespace kmax::record
