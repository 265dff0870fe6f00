#include "tools/trace/csv_export.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <string>

#include "drivers/monotonic_clock.h"
#include "drivers/trace/fields.h"
#include "drivers/trace/names.h"
#include "tools/trace/columns.h"
#include "tools/trace/selected_trace.h"

namespace hapticd::tools {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kWrittenAtOnce = 1 << 20;

struct HeaderOfFields {
  std::string& line;

  void operator()(std::string_view name, const auto&) {
    fmt::format_to(std::back_inserter(line), ",{}", name);
  }
  void operator()(std::string_view name, const rt::Vec3&) {
    for (const char axis : {'x', 'y', 'z'}) fmt::format_to(std::back_inserter(line), ",{}_{}", name, axis);
  }
};

struct CsvRow {
  std::string& line;

  void operator()(std::string_view, const std::integral auto& value) {
    fmt::format_to(std::back_inserter(line), ",{}", +value);
  }
  // the shortest number that reads back as the same one
  void operator()(std::string_view, double value) { fmt::format_to(std::back_inserter(line), ",{}", value); }
  template <drivers::NamedEnumeration Enumeration>
  void operator()(std::string_view, const Enumeration& value) {
    line += "," + std::string(drivers::kNames<Enumeration>[static_cast<std::size_t>(value)]);
  }
  void operator()(std::string_view name, const rt::Vec3& vector) {
    for (const double component : {vector.x, vector.y, vector.z}) (*this)(name, component);
  }
  void operator()(std::string_view, const std::string& text) {
    line += ",\"";
    for (const char c : text) line += c == '"' ? "\"\"" : std::string(1, c);
    line += '"';
  }
  void operator()(std::string_view name, const Pairs& pairs) { (*this)(name, joined(pairs)); }
};

/// Nanoseconds as decimal seconds, exactly.
std::string secondsText(std::int64_t time_ns) {
  const std::uint64_t size_ns =
      time_ns < 0 ? -static_cast<std::uint64_t>(time_ns) : static_cast<std::uint64_t>(time_ns);
  constexpr auto kSecond = static_cast<std::uint64_t>(drivers::kNsPerSecond);
  return fmt::format("{}{}.{:09}", time_ns < 0 ? "-" : "", size_ns / kSecond, size_ns % kSecond);
}

std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

class CsvFile {
 public:
  CsvFile(WholeFile file, const SelectedTrace& trace) : file_(std::move(file)), trace_(trace) {}

  template <typename Record>
  void addHeader() {
    text_ += "time_s,realtime_s";
    const Record record{};
    trace_.visitKnown(record, HeaderOfFields{text_});
    text_ += '\n';
  }

  bool addRow(const auto& record) {
    const std::int64_t time_ns = drivers::timeOf(record);
    text_ += secondsText(sum(time_ns, sum(0, -trace_.start_ns()))) + "," +
             secondsText(sum(time_ns, trace_.realtimeOffset_ns()));
    trace_.visitKnown(record, CsvRow{text_});
    text_ += '\n';
    ++rows_;
    if (text_.size() >= kWrittenAtOnce) write();
    return written_.has_value();
  }

  config::Result<std::uint64_t> finish() {
    write();
    if (written_) written_ = file_.finish();
    if (!written_) return std::unexpected(written_.error());
    return rows_;
  }

 private:
  void write() {
    if (written_) written_ = file_.append(text_);
    text_.clear();
  }

  WholeFile file_;
  const SelectedTrace& trace_;
  std::string text_;
  std::uint64_t rows_ = 0;
  config::Result<void> written_;
};

/// `visit`: what the channel's records go to.
template <typename Record>
config::Result<std::uint64_t> exportChannel(const SelectedTrace& trace, WholeFile file,
                                            std::function<bool(const Record&)> drivers::TraceVisitor::*visit,
                                            const Progress& progress) {
  CsvFile csv(std::move(file), trace);
  csv.addHeader<Record>();
  drivers::TraceVisitor visitor;
  visitor.*visit = [&csv](const Record& record) { return csv.addRow(record); };
  const auto read = trace.read(visitor, progress);
  if (!read) return std::unexpected(read.error());
  const auto there = read->require(trace.file(), drivers::kChannelName<Record>.topic);
  if (!there) return std::unexpected(there.error());
  return csv.finish();
}

}  // namespace

config::Result<std::uint64_t> exportCsv(const std::filesystem::path& trace_file,
                                        const std::filesystem::path& csv_file, TraceChannel channel,
                                        const TraceSelection& selection, const Progress& progress,
                                        IfExists if_exists) {
  const auto trace = SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  auto file = WholeFile::create(csv_file, if_exists);
  if (!file) return std::unexpected(file.error());
  using Visitor = drivers::TraceVisitor;
  switch (channel) {
    case TraceChannel::ticks:
      return exportChannel<rt::Tick>(*trace, std::move(*file), &Visitor::tick, progress);
    case TraceChannel::models:
      return exportChannel<drivers::ModelRecord>(*trace, std::move(*file), &Visitor::model, progress);
    case TraceChannel::directives:
      return exportChannel<drivers::DirectiveRecord>(*trace, std::move(*file), &Visitor::directive, progress);
    case TraceChannel::events:
      break;
  }
  return exportChannel<drivers::EventRecord>(*trace, std::move(*file), &Visitor::event, progress);
}

}  // namespace hapticd::tools
