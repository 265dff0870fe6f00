// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/export/trace_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/base/value_text.h"
#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/export/trace_summary.h"
#include "daemon/trace/format/depth_codec.h"
#include "daemon/trace/format/messages.h"
#include "daemon/trace/format/records.h"
#include "drivers/camera/recorded/recording_writer.h"
#include "rt/base/clock.h"
#include "rt/base/words.h"

namespace hapticd::trace {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kWrittenAtOnce = 1 << 20;
/// Each gives a column, and a cell in every row; hapticd has some hundred parameters.
constexpr std::size_t kMaxParameters = 1000;
/// The field of directives whose names and values become columns of their own.
constexpr std::string_view kParameters = "parameters";

/// Quotes a text as a field of CSV (RFC 4180).
std::string inCsvQuotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// Joins names and values in one line: "name=value; name=value".
std::string joined(const Pairs& pairs) {
  std::string text;
  for (const auto& [name, value] : pairs) text += (text.empty() ? "" : "; ") + name + "=" + value;
  return text;
}

struct HeaderOfFields {
  std::string& line;

  void operator()(std::string_view name, const auto&) {
    fmt::format_to(std::back_inserter(line), ",{}", name);
  }
  /// Each parameter of a directive has a column of its own.
  void operator()(std::string_view name, const Pairs&) {
    if (name != kParameters) fmt::format_to(std::back_inserter(line), ",{}", name);
  }
  void operator()(std::string_view name, const rt::Vec3&) {
    for (const char axis : {'x', 'y', 'z'}) fmt::format_to(std::back_inserter(line), ",{}_{}", name, axis);
  }
};

template <typename Record>
struct CsvRow {
  std::string& line;
  const SelectedTrace& trace;
  const Record& record;

  template <typename Field>
  void operator()(std::string_view name, const Field& field) {
    if constexpr (std::is_same_v<Record, rt::Tick>) {
      if (!trace.fieldApplies(record, name)) {
        line += std::is_same_v<Field, rt::Vec3> ? ",,," : ",";
        return;
      }
    }
    put(name, field);
  }

 private:
  void put(std::string_view, const std::integral auto& value) {
    fmt::format_to(std::back_inserter(line), ",{}", +value);
  }
  // the shortest number that reads back as the same one
  void put(std::string_view, double value) { fmt::format_to(std::back_inserter(line), ",{}", value); }
  template <rt::Worded Enumeration>
  void put(std::string_view, const Enumeration& value) {
    line += "," + std::string(rt::wordOf(value));
  }
  void put(std::string_view name, const rt::Vec3& vector) {
    for (const double component : {vector.x, vector.y, vector.z}) put(name, component);
  }
  void put(std::string_view, const std::string& text) { line += "," + inCsvQuotes(text); }
  void put(std::string_view name, const Pairs& pairs) {
    if (name != kParameters) put(name, joined(pairs));
  }
};

/// Formats nanoseconds as decimal seconds without rounding.
std::string secondsText(std::int64_t time_ns) {
  const std::uint64_t size_ns =
      time_ns < 0 ? -static_cast<std::uint64_t>(time_ns) : static_cast<std::uint64_t>(time_ns);
  constexpr auto kSecond = static_cast<std::uint64_t>(rt::kNsPerSecond);
  return fmt::format("{}{}.{:09}", time_ns < 0 ? "-" : "", size_ns / kSecond, size_ns % kSecond);
}

std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

class CsvFile {
 public:
  CsvFile(base::WholeFile file, const SelectedTrace& trace) : file_(std::move(file)), trace_(trace) {}

  /// more: names of columns after those of the fields.
  template <typename Record>
  void addHeader(const std::vector<std::string>& more = {}) {
    text_ += "time_s,realtime_s";
    const Record record{};
    visitKnown(record, HeaderOfFields{text_});
    for (const std::string& name : more) text_ += "," + inCsvQuotes(name);
    text_ += '\n';
  }

  /// more: the cells of these columns, already formatted.
  template <typename Record>
  bool addRow(const Record& record, const std::vector<std::string>& more = {}) {
    const std::int64_t time_ns = timeOf(record);
    text_ += secondsText(sum(time_ns, sum(0, -trace_.start_ns()))) + "," +
             secondsText(sum(time_ns, trace_.realtimeOffset_ns()));
    visitKnown(record, CsvRow<Record>{text_, trace_, record});
    for (const std::string& cell : more) text_ += "," + cell;
    text_ += '\n';
    ++rows_;
    if (text_.size() >= kWrittenAtOnce) write();
    return written_.has_value();
  }

  base::Result<std::uint64_t> finish() {
    write();
    if (written_) written_ = file_.finish();
    if (!written_) return std::unexpected(written_.error());
    return rows_;
  }

 private:
  /// Like visitFields(), but without the fields that the trace lacks.
  template <typename Record>
  void visitKnown(const Record& record, auto&& visit) const {
    visitFields(record, [&](std::string_view name, const auto& field) {
      if (!trace_.lacks<Record>(name)) visit(name, field);
    });
  }

  void write() {
    if (written_) written_ = file_.append(text_);
    text_.clear();
  }

  base::WholeFile file_;
  const SelectedTrace& trace_;
  std::string text_;
  std::uint64_t rows_ = 0;
  base::Result<void> written_;
};

/// Stops at the first record that cannot be read.
class CsvExport {
 public:
  CsvExport(const SelectedTrace& trace, base::WholeFile file, const Progress& progress)
      : trace_(trace), csv_(std::move(file), trace), progress_(progress) {}

  /// `visit`: takes the records of the channel.
  template <typename Record>
  base::Result<TraceInfo> write(std::function<bool(const Record&)> TraceVisitor::*visit) {
    csv_.addHeader<Record>();
    TraceVisitor visitor;
    visitor.*visit = [this](const Record& record) { return csv_.addRow(record); };
    return read<Record>(visitor);
  }

  /// Directives are kept, because the names of their parameters are known only at the end; there are few
  /// directives.
  base::Result<TraceInfo> writeDirectives() {
    std::vector<DirectiveRecord> directives;
    std::vector<std::string> names;
    std::map<std::string, std::size_t, std::less<>> columns;
    const auto keep = [&](const DirectiveRecord& directive) {
      for (const auto& [name, value] : directive.parameters) {
        if (columns.try_emplace(name, names.size()).second) names.push_back(name);
        if (names.size() > kMaxParameters) return false;
      }
      directives.push_back(directive);
      return true;
    };
    auto info = read<DirectiveRecord>({.directive = keep});
    if (!info) return info;
    if (names.size() > kMaxParameters) {
      return base::failure(trace_.file().string(),
                           fmt::format("has more than {} different parameters", kMaxParameters),
                           "no hapticd has so many; export another channel");
    }
    csv_.addHeader<DirectiveRecord>(names);
    for (const DirectiveRecord& directive : directives) csv_.addRow(directive, cellsOf(directive, columns));
    return info;
  }

  base::Result<std::uint64_t> finish() { return csv_.finish(); }

 private:
  /// Errors: also a trace without that channel, which another program removed.
  template <typename Record>
  base::Result<TraceInfo> read(const TraceVisitor& visitor) {
    auto info = trace_.read(visitor, progress_);
    if (!info) return info;
    const auto there = info->require(trace_.file(), kChannelName<Record>.topic);
    if (!there) return std::unexpected(there.error());
    return info;
  }

  /// Numbers as they are, texts in quotes, an empty cell for what the record lacks.
  static std::vector<std::string> cellsOf(const DirectiveRecord& directive,
                                          const std::map<std::string, std::size_t, std::less<>>& columns) {
    std::vector<std::string> cells(columns.size());
    for (const auto& [name, value] : directive.parameters) {
      const std::size_t column = columns.at(name);
      const std::optional<double> number = numberIn(value);
      cells[column] = number ? fmt::format("{}", *number) : inCsvQuotes(value);
    }
    return cells;
  }

  const SelectedTrace& trace_;
  CsvFile csv_;
  const Progress& progress_;
};

base::Result<TraceInfo> writeChannel(CsvExport& csv, TraceChannel channel) {
  using Visitor = TraceVisitor;
  switch (channel) {
    case TraceChannel::ticks:
      return csv.write<rt::Tick>(&Visitor::tick);
    case TraceChannel::models:
      return csv.write<ModelRecord>(&Visitor::model);
    case TraceChannel::directives:
      return csv.writeDirectives();
    case TraceChannel::events:
      break;
  }
  return csv.write<EventRecord>(&Visitor::event);
}

/// The configuration of the trace, with its metadata as comments.
std::string settingsFile(const TraceInfo& trace) {
  std::string text;
  for (const auto& [name, value] : trace.metadata) {
    text += fmt::format("# {}: {}\n", base::printable(name), base::printable(value));
  }
  const std::string_view settings = settingsText(trace);
  return text + (settings.empty() ? "# the trace holds no settings\n" : std::string(settings));
}

}  // namespace

std::filesystem::path settingsBeside(const std::filesystem::path& csv) {
  return std::filesystem::path(csv).replace_extension(".settings.yaml");
}

base::Result<std::uint64_t> exportCsv(const std::filesystem::path& trace_file,
                                      const std::filesystem::path& csv_file, TraceChannel channel,
                                      const TraceSelection& selection, const Progress& progress,
                                      base::IfExists if_exists) {
  const auto trace = SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  auto file = base::WholeFile::create(csv_file, if_exists);
  if (!file) return std::unexpected(file.error());
  auto settings = base::WholeFile::create(settingsBeside(csv_file), if_exists);
  if (!settings) return std::unexpected(settings.error());
  CsvExport csv(*trace, std::move(*file), progress);
  const auto info = writeChannel(csv, channel);
  if (!info) return std::unexpected(info.error());
  if (auto kept = settings->append(settingsFile(*info)); !kept) return std::unexpected(kept.error());
  const auto rows = csv.finish();
  if (!rows) return rows;
  if (auto kept = settings->finish(); !kept) return std::unexpected(kept.error());
  return rows;
}

namespace {

namespace fs = std::filesystem;

fs::path draftOf(const fs::path& folder) {
  return folder.string() + ".part";
}

base::Result<void> mayBegin(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored))
    return base::failure(folder, "exists already", "name a new folder with --out");
  if (fs::exists(draftOf(folder), ignored)) {
    return base::failure(draftOf(folder), "exists: an export is at work, or was cut off",
                         "wait for it, or delete it");
  }
  return {};
}

/// Whether frames of the camera are what libfreenect's format holds.
bool isKinect(const rt::DepthModelParameters& camera) {
  const rt::DepthModelParameters kinect;
  return camera.law == kinect.law && camera.width_px == kinect.width_px &&
         camera.height_px == kinect.height_px && camera.raw_values == kinect.raw_values &&
         camera.raw_no_measurement == kinect.raw_no_measurement;
}

/// Writes frames in the format of the first one's camera.
class FolderWriter {
 public:
  FolderWriter(fs::path folder, std::int64_t realtime_offset_ns)
      : folder_(std::move(folder)), realtime_offset_ns_(realtime_offset_ns) {}

  base::Result<void> write(const rt::DepthFrame& frame, std::string serial) {
    if (frames_ == 0) {
      if (auto begun = begin(frame, std::move(serial)); !begun) return begun;
    }
    ++frames_;
    if (of_camera_) return of_camera_->write(frame);
    if (isKinect(frame.camera)) return of_kinect_->write(frame);
    return base::failure(folder_, "the trace is of a Kinect v1 at first and then of another camera",
                         "choose the stretch of one camera with --from and --to");
  }
  std::uint64_t frames() const { return frames_; }

 private:
  base::Result<void> begin(const rt::DepthFrame& frame, std::string serial) {
    if (isKinect(frame.camera)) {
      auto writer = drivers::RecordingWriter::create(folder_, realtime_offset_ns_);
      if (!writer) return std::unexpected(writer.error());
      of_kinect_ = std::move(*writer);
      return {};
    }
    const drivers::CameraDescription description{
        .camera = frame.camera, .near_m = {}, .far_m = {}, .serial = std::move(serial)};
    auto writer = drivers::CameraRecordingWriter::create(folder_, description, realtime_offset_ns_);
    if (!writer) return std::unexpected(writer.error());
    of_camera_ = std::move(*writer);
    return {};
  }

  fs::path folder_;
  std::int64_t realtime_offset_ns_;
  std::unique_ptr<drivers::RecordingWriter> of_kinect_;
  std::unique_ptr<drivers::CameraRecordingWriter> of_camera_;
  std::uint64_t frames_ = 0;
};

std::string serialOf(const rt::DepthFrameHeader& header) {
  return {header.serial.begin(), std::ranges::find(header.serial, 0)};
}

/// Writes the content of the folder.
base::Result<std::uint64_t> writeFrames(const SelectedTrace& trace, const fs::path& file,
                                        const fs::path& draft, const Progress& progress) {
  FolderWriter writer(draft, trace.realtimeOffset_ns());
  DepthDecoder decoder;
  const auto frame = std::make_unique<rt::DepthFrame>();
  base::Result<void> written;
  const auto write = [&](const DepthRecord& record) {
    const std::string wrong = decoder.decode(record, *frame);
    written = wrong.empty() ? writer.write(*frame, serialOf(record.header)) : base::failure(file, wrong, "");
    return written.has_value();
  };
  const auto info = trace.readAll({.depth = write}, progress);
  if (!written) return std::unexpected(written.error());
  if (!info) return std::unexpected(info.error());
  if (!info->topics.contains(kChannelName<DepthRecord>.topic)) {
    return base::failure(file, "holds no depth", "write it with depth: hapticctl trace start --depth");
  }
  if (writer.frames() == 0) {
    return base::failure(file, "holds no depth in that time", "choose another stretch with --from and --to");
  }
  return writer.frames();
}

}  // namespace

base::Result<std::uint64_t> exportRecording(const fs::path& trace, const fs::path& folder,
                                            const TraceSelection& selection, const Progress& progress) {
  const auto selected = SelectedTrace::open(trace, selection);
  if (!selected) return std::unexpected(selected.error());
  if (auto possible = mayBegin(folder); !possible) return std::unexpected(possible.error());
  const fs::path draft = draftOf(folder);
  auto frames = writeFrames(*selected, trace, draft, progress);
  std::error_code failure;
  if (frames) fs::rename(draft, folder, failure);
  if (frames && !failure) return frames;
  std::error_code ignored;
  fs::remove_all(draft, ignored);
  if (!frames) return frames;
  return base::failure(folder, "cannot be created: " + failure.message(), "name a new folder with --out");
}

}  // namespace hapticd::trace
