// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/hdf5_export.h"

#include <fmt/format.h>

#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "drivers/trace/fields.h"
#include "rt/words.h"
#include "tools/lib/trace/columns.h"
#include "tools/lib/trace/hdf5_file.h"
#include "tools/lib/trace/parameter_columns.h"
#include "tools/lib/trace/selected_trace.h"
#include "tools/lib/trace/trace_settings.h"

namespace hapticd::tools {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

template <typename Number>
hid_t numberType() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<Number, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return H5T_NATIVE_UINT32;
  if constexpr (std::is_same_v<Number, std::int32_t>) return H5T_NATIVE_INT32;
  if constexpr (sizeof(Number) == 1) return H5T_NATIVE_UINT8;
}

/// Creates a column for each field that it visits.
struct ColumnsOfFields {
  hid_t group;
  std::vector<Hdf5Column>& columns;
  bool& good;

  Hdf5Column& column(std::string_view name, hid_t type, std::size_t width = 1) {
    columns.emplace_back(group, std::string(name), type, width);
    good = good && addAttribute(columns.back().dataset(), "unit", std::string(unitOf(name)));
    return columns.back();
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void operator()(std::string_view name, const Number&) { column(name, numberType<Number>()); }
  template <rt::Worded Enumeration>
  void operator()(std::string_view name, const Enumeration&) {
    const Hdf5Column& added = column(name, H5T_NATIVE_UINT8);
    std::vector<std::string_view> names(rt::kWords<Enumeration>.begin(), rt::kWords<Enumeration>.end());
    if (needsProxy(name)) names.push_back("does_not_apply");
    good = good && addAttribute(added.dataset(), "names", names);
    sayWhenItApplies(name, added);
  }
  void operator()(std::string_view name, const rt::Vec3&) {
    sayWhenItApplies(name, column(name, H5T_NATIVE_DOUBLE, 3));
  }
  void sayWhenItApplies(std::string_view name, const Hdf5Column& added) {
    if (!needsProxy(name)) return;
    good = good && addAttribute(added.dataset(), "applies_to", std::string("the laws proxy and surface"));
  }
  void operator()(std::string_view name, const std::string&) { column(name, hdf5TextType()); }
  /// Each parameter of a directive has a column of its own.
  void operator()(std::string_view name, const Pairs&) {
    if (name != kParameters) column(name, hdf5TextType());
  }
};

template <typename Record>
struct Hdf5Row {
  std::vector<Hdf5Column>& columns;
  std::size_t& next;
  const SelectedTrace& trace;
  const Record& record;

  template <typename Value>
  requires std::is_arithmetic_v<Value>
  void operator()(std::string_view, const Value& value) { column().add(&value, sizeof value); }
  /// The value after the last enumerator, for a field that does not apply.
  template <rt::Worded Value>
  void operator()(std::string_view name, const Value& value) {
    const auto none = static_cast<std::uint8_t>(rt::kWords<Value>.size());
    const std::uint8_t kept = trace.fieldApplies(record, name) ? static_cast<std::uint8_t>(value) : none;
    column().add(&kept, sizeof kept);
  }
  void operator()(std::string_view name, const rt::Vec3& vector) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    const bool applies_here = trace.fieldApplies(record, name);
    const double components[] = {applies_here ? vector.x : none, applies_here ? vector.y : none,
                                 applies_here ? vector.z : none};
    column().add(components, sizeof components);
  }
  void operator()(std::string_view, const std::string& text) { column().add(text); }
  void operator()(std::string_view name, const Pairs& pairs) {
    if (name != kParameters) column().add(joined(pairs));
  }

  Hdf5Column& column() { return columns[next++]; }
};

/// A channel as a group of columns.
class Table {
 public:
  template <typename Record>
  Table(hid_t file, const char* name, const Record& example, const SelectedTrace& trace)
      : trace_(trace),
        group_(::H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), ::H5Gclose),
        good_(group_.good()) {
    for (const char* time : {"time_s", "realtime_s"}) {
      columns_.emplace_back(group_, time, H5T_NATIVE_DOUBLE, 1);
      good_ = good_ && addAttribute(columns_.back().dataset(), "unit", std::string("s"));
    }
    trace_.visitKnown(example, ColumnsOfFields{group_, columns_, good_});
    if constexpr (std::is_same_v<Record, drivers::DirectiveRecord>)
      parameters_.emplace(group_, std::string(kParameters));
  }

  template <typename Record>
  void add(const Record& record) {
    const std::int64_t time_ns = drivers::timeOf(record);
    const double times_s[] = {trace_.seconds(time_ns), trace_.realtimeSeconds(time_ns)};
    std::size_t next = 0;
    for (const double& time_s : times_s) columns_[next++].add(&time_s, sizeof time_s);
    trace_.visitKnown(record, Hdf5Row<Record>{columns_, next, trace_, record});
    for (Hdf5Column& column : columns_) column.endRow();
    if constexpr (std::is_same_v<Record, drivers::DirectiveRecord>) parameters_->addRow(record.parameters);
    ++rows_;
  }

  bool finish() {
    if (parameters_) good_ = parameters_->finish() && good_;
    for (Hdf5Column& column : columns_) good_ = column.finish() && good_;
    return group_.close() && good_;
  }
  std::uint64_t rows() const { return rows_; }

 private:
  const SelectedTrace& trace_;
  Hdf5Handle group_;
  std::vector<Hdf5Column> columns_;
  std::optional<ParameterColumns> parameters_;
  std::uint64_t rows_ = 0;
  bool good_;
};

/// Writes the whole configuration, as attributes and as the original text.
bool addSettings(hid_t file, const drivers::TraceInfo& trace) {
  const std::string text(settingsText(trace));
  if (text.empty()) return true;
  Hdf5Handle group(::H5Gcreate2(file, "settings", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), ::H5Gclose);
  bool good = group.good() && addText(group, "yaml", text);
  for (const TraceSetting& setting : settingsIn(text)) {
    const std::optional<double> number = setting.text ? std::nullopt : numberIn(setting.value);
    good = good && (number ? addAttribute(group, setting.name, *number)
                           : addAttribute(group, setting.name, setting.value));
  }
  return group.close() && good;
}

bool addMetadata(hid_t file, const drivers::TraceInfo& trace, std::int64_t start_ns) {
  bool good = addAttribute(file, "start_ns", start_ns) &&
              addAttribute(file, "realtime_offset_ns", trace.realtime_offset_ns);
  for (const auto& [name, value] : trace.metadata) {
    // a kernel version "6.10" and a serial number "007" are not numbers
    const std::optional<double> number = name == "force_thread_cpu" ? numberIn(value) : std::nullopt;
    good = good && (number ? addAttribute(file, name, static_cast<std::int64_t>(*number))
                           : addAttribute(file, name, value));
  }
  return good;
}

config::Error fillError(const std::filesystem::path& file) {
  return {file.string(), "libhdf5 does not take what is in the trace",
          "is there memory for the whole file? Or export a stretch: --from, --to"};
}

/// Writes all channels into an open file; nothing if they could not be written.
config::Result<std::optional<std::uint64_t>> fill(hid_t file, const SelectedTrace& trace,
                                                  const Progress& progress) {
  Table ticks(file, "ticks", rt::Tick{}, trace), models(file, "models", drivers::ModelRecord{}, trace),
      directives(file, "directives", drivers::DirectiveRecord{}, trace),
      events(file, "events", drivers::EventRecord{}, trace);
  const auto into = [](Table& table) {
    return [&table](const auto& record) {
      table.add(record);
      return true;
    };
  };
  const auto read = trace.read(
      {.tick = into(ticks), .model = into(models), .directive = into(directives), .event = into(events)},
      progress);
  if (!read) return std::unexpected(read.error());
  bool good = addMetadata(file, *read, trace.start_ns()) && addSettings(file, *read);
  std::uint64_t rows = 0;
  for (Table* const table : {&ticks, &models, &directives, &events}) {
    good = table->finish() && good;
    rows += table->rows();
  }
  return good ? std::optional(rows) : std::nullopt;
}

}  // namespace

config::Result<std::uint64_t> exportHdf5(const std::filesystem::path& trace_file,
                                         const std::filesystem::path& hdf5_file,
                                         const TraceSelection& selection, const Progress& progress,
                                         IfExists if_exists) {
  const auto trace = SelectedTrace::open(trace_file, selection);
  if (!trace) return std::unexpected(trace.error());
  auto whole = WholeFile::create(hdf5_file, if_exists);
  if (!whole) return std::unexpected(whole.error());
  ::H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // it would print errors that are reported here
  Hdf5Memory file;
  if (!file.good()) return std::unexpected(fillError(hdf5_file));
  const auto rows = fill(file.id(), *trace, progress);
  if (!rows) return std::unexpected(rows.error());
  const auto content = file.content();
  if (!content || !*rows) return std::unexpected(fillError(hdf5_file));
  if (auto written = whole->append(*content); !written) return std::unexpected(written.error());
  if (auto finished = whole->finish(); !finished) return std::unexpected(finished.error());
  return **rows;
}

}  // namespace hapticd::tools
