#include "drivers/trace/trace_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "drivers/monotonic_clock.h"
#include "drivers/trace/trace_file.h"
#include "drivers/trace/trace_head.h"

namespace hapticd::drivers {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".mcap";
constexpr std::string_view kPartEnding = ".mcap.part";
constexpr std::string_view kDepthEnding = ".depth";
constexpr std::size_t kLongestName = 100;

std::unexpected<config::Error> refuse(const fs::path& where, std::string what, std::string remedy) {
  return std::unexpected(config::Error{where.string(), std::move(what), std::move(remedy)});
}

fs::path fileOf(const fs::path& folder, std::string_view name, std::string_view ending) {
  return folder / (std::string(name) + std::string(ending));
}

bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
         c == '.';
}

/// Of all files in a folder; what vanishes meanwhile counts for nothing.
std::uint64_t bytesIn(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    std::error_code no_file;
    const std::uintmax_t size = entry->file_size(no_file);
    if (!no_file) bytes += size;
  }
  return bytes;
}

/// Nothing for what is no trace, or has just been renamed or deleted.
bool describe(const fs::path& file, TraceEntry& entry) {
  const std::string name = file.filename().string();
  entry.open = name.ends_with(kPartEnding);
  if (!entry.open && !name.ends_with(kEnding)) return false;
  entry.name = name.substr(0, name.size() - (entry.open ? kPartEnding : kEnding).size());
  struct stat status {};
  if (!isTraceName(entry.name) || ::stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
    return false;
  entry.bytes = static_cast<std::uint64_t>(status.st_size);
  entry.time_ns = std::int64_t{status.st_mtim.tv_sec} * kNsPerSecond + status.st_mtim.tv_nsec;
  const fs::path depth = fileOf(file.parent_path(), entry.name, kDepthEnding);
  std::error_code ignored;
  const bool beside = fs::is_directory(depth, ignored);
  if (beside) entry.bytes += bytesIn(depth);
  entry.depth = beside || hasDepthChannel(file);
  return true;
}

}  // namespace

bool isTraceName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
         std::ranges::all_of(name, isNameCharacter);
}

std::string newTraceName(const fs::path& folder, std::int64_t realtime_ns, std::string_view label) {
  constexpr std::size_t kRoomForNumber = 8;
  const auto seconds = static_cast<std::time_t>(realtime_ns / kNsPerSecond);
  std::string name = fmt::format("{:%Y-%m-%dT%H-%M-%S}Z", fmt::gmtime(seconds));
  if (!label.empty()) name += "-" + std::string(label.substr(0, kLongestName - name.size() - kRoomForNumber));
  std::ranges::replace_if(
      name, [](char c) { return !isNameCharacter(c); }, '-');
  const auto taken = [&folder](const std::string& candidate) {
    std::error_code ignored;
    return std::ranges::any_of(std::array{kEnding, kPartEnding, kDepthEnding}, [&](std::string_view ending) {
      return fs::exists(fileOf(folder, candidate, ending), ignored);
    });
  };
  std::string candidate = name;
  for (int number = 2; taken(candidate); ++number) candidate = fmt::format("{}-{}", name, number);
  return candidate;
}

config::Result<std::vector<TraceEntry>> listTraces(const fs::path& folder) {
  std::vector<TraceEntry> traces;
  std::error_code failure;
  if (!fs::exists(folder, failure) && !failure) return traces;
  fs::directory_iterator file(folder, failure);
  for (const fs::directory_iterator end; !failure && file != end; file.increment(failure)) {
    TraceEntry entry;
    if (describe(file->path(), entry)) traces.push_back(std::move(entry));
  }
  if (failure) {
    return refuse(folder, "cannot be read: " + failure.message(), "check state.folder and its permissions");
  }
  std::ranges::sort(traces, {}, [](const TraceEntry& entry) { return std::pair(entry.time_ns, entry.name); });
  return traces;
}

config::Result<void> deleteTrace(const fs::path& folder, std::string_view name) {
  if (!isTraceName(name)) {
    return refuse({}, fmt::format("\"{}\" is no name of a trace", name.substr(0, kLongestName)),
                  "1 to 100 letters, digits, '-', '_' and '.', not beginning with '.'");
  }
  std::error_code failure;
  const fs::path file = fileOf(folder, name, kEnding);
  if (fs::exists(fileOf(folder, name, kPartEnding), failure)) {
    return refuse(file, "is being written", "stop the trace first");
  }
  if (!fs::exists(file, failure))
    return refuse(file, "there is no such trace", "list them: hapticctl trace list");
  fs::remove(file, failure);
  // the trace goes first: a depth recording alone is listed nowhere, but a trace without its one is
  if (!failure) fs::remove_all(fileOf(folder, name, kDepthEnding), failure);
  if (failure) {
    return refuse(file, "cannot be deleted: " + failure.message(), "check the permissions of the folder");
  }
  return {};
}

config::Result<std::vector<std::string>> limitFolder(const fs::path& folder, std::uint64_t most_bytes) {
  auto traces = listTraces(folder);
  if (!traces) return std::unexpected(traces.error());
  std::uint64_t bytes = 0;
  for (const TraceEntry& trace : *traces) bytes += trace.bytes;
  std::vector<std::string> deleted;
  for (const TraceEntry& trace : *traces) {
    if (bytes <= most_bytes) break;
    if (trace.open) continue;
    if (auto done = deleteTrace(folder, trace.name); !done) return std::unexpected(done.error());
    bytes -= trace.bytes;
    deleted.push_back(trace.name);
  }
  return deleted;
}

}  // namespace hapticd::drivers
