#include "tools/trace/hdf5_export.h"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/trace/fields.h"
#include "drivers/trace/names.h"
#include "tools/trace/columns.h"
#include "tools/trace/hdf5_file.h"
#include "tools/trace/selected_trace.h"

namespace hapticd::tools {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

template <typename Number>
hid_t numberType() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<Number, std::int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return H5T_NATIVE_UINT32;
  if constexpr (sizeof(Number) == 1) return H5T_NATIVE_UINT8;
}

/// Makes a column for each field that it visits.
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
  template <drivers::NamedEnumeration Enumeration>
  void operator()(std::string_view name, const Enumeration&) {
    const Hdf5Column& added = column(name, H5T_NATIVE_UINT8);
    good = good && addAttribute(added.dataset(), "names", drivers::kNames<Enumeration>);
  }
  void operator()(std::string_view name, const rt::Vec3&) { column(name, H5T_NATIVE_DOUBLE, 3); }
  void operator()(std::string_view name, const std::string&) { column(name, hdf5TextType()); }
  void operator()(std::string_view name, const Pairs&) { column(name, hdf5TextType()); }
};

struct Hdf5Row {
  std::vector<Hdf5Column>& columns;
  std::size_t& next;

  template <typename Value>
  requires std::is_arithmetic_v<Value> || drivers::NamedEnumeration<Value>
  void operator()(std::string_view, const Value& value) { column().add(&value, sizeof value); }
  void operator()(std::string_view, const rt::Vec3& vector) {
    const double components[] = {vector.x, vector.y, vector.z};
    column().add(components, sizeof components);
  }
  void operator()(std::string_view, const std::string& text) { column().add(text); }
  void operator()(std::string_view, const Pairs& pairs) { column().add(joined(pairs)); }

  Hdf5Column& column() { return columns[next++]; }
};

/// A channel: a group of columns.
class Table {
 public:
  template <typename Record>
  Table(hid_t file, const char* name, const Record& example, const SelectedTrace& trace)
      : trace_(trace),
        group_(::H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), ::H5Gclose),
        good_(group_.good()) {
    trace_.visitKnown(example, ColumnsOfFields{group_, columns_, good_});
  }

  void add(const auto& record) {
    std::size_t next = 0;
    trace_.visitKnown(record, Hdf5Row{columns_, next});
    for (Hdf5Column& column : columns_) column.endRow();
    ++rows_;
  }

  bool finish() {
    for (Hdf5Column& column : columns_) good_ = column.finish() && good_;
    return group_.close() && good_;
  }
  std::uint64_t rows() const { return rows_; }

 private:
  const SelectedTrace& trace_;
  Hdf5Handle group_;
  std::vector<Hdf5Column> columns_;
  std::uint64_t rows_ = 0;
  bool good_;
};

config::Error writeError(const std::filesystem::path& file) {
  return {file.string(), "cannot be written as HDF5",
          "is there space, and may the user write into the folder?"};
}

/// Everything into an open file. Nothing: it could not be written.
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
  bool good = addAttribute(file, "start_ns", std::to_string(trace.start_ns())) &&
              addAttribute(file, "realtime_offset_ns", std::to_string(trace.realtimeOffset_ns()));
  for (const auto& [name, value] : trace.metadata()) good = addAttribute(file, name, value) && good;
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
  ::H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // it would print what we say ourselves
  Hdf5Handle file(::H5Fcreate(whole->draft().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), ::H5Fclose);
  if (!file.good()) return std::unexpected(writeError(hdf5_file));
  const auto rows = fill(file, *trace, progress);
  if (!rows) return std::unexpected(rows.error());
  if (!file.close() || !*rows) return std::unexpected(writeError(hdf5_file));
  if (auto finished = whole->finish(); !finished) return std::unexpected(finished.error());
  return **rows;
}

}  // namespace hapticd::tools
