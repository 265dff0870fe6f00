// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/reader/trace_folder.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <limits>
#include <optional>

#include "config/base/file_content.h"
#include "config/base/value_text.h"
#include "daemon/trace/format/trace_format.h"
#include "daemon/trace/mcap/trace_file.h"
#include "rt/base/clock.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".mcap";
constexpr std::string_view kPartEnding = ".mcap.part";
constexpr std::string_view kDamagedEnding = ".mcap.damaged";  // or the same with a number: -2
constexpr std::string_view kKeepEnding = ".keep";
constexpr std::string_view kNoteEnding = ".note";
/// Length of the time at the beginning of a name, "2026-03-04T05-06-07Z" (UTC).
constexpr std::size_t kTimeLength = 20;
constexpr std::size_t kMaxNameLength = 100;

fs::path fileOf(const fs::path& folder, std::string_view name, std::string_view ending) {
  return folder / (std::string(name) + std::string(ending));
}

bool isNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
         c == '.';
}

bool has(const fs::path& folder, std::string_view name, std::string_view ending) {
  std::error_code ignored;
  return fs::exists(fileOf(folder, name, ending), ignored);
}

/// Returns the name of the trace that a damaged original was recovered to; nothing for another name.
std::optional<std::string_view> recoveredFrom(std::string_view name) {
  const std::size_t at = name.rfind(kDamagedEnding);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view number = name.substr(at + kDamagedEnding.size());
  const bool numbered = number.size() > 1 && number.front() == '-' &&
                        number.find_first_not_of("0123456789", 1) == std::string_view::npos;
  if (!number.empty() && !numbered) return std::nullopt;
  return name.substr(0, at);
}

/// Returns the file of a trace that is not being written.
fs::path finishedFile(const fs::path& folder, std::string_view name) {
  const bool damaged = recoveredFrom(name) && !has(folder, name, kEnding);
  return fileOf(folder, name, damaged ? "" : kEnding);
}

bool isFinished(const fs::path& folder, std::string_view name) {
  std::error_code ignored;
  return fs::exists(finishedFile(folder, name), ignored);
}

/// Returns the time at the beginning of a name; nothing for other names.
std::optional<std::int64_t> beginOf(std::string_view name) {
  if (name.size() < kTimeLength) return std::nullopt;
  std::tm utc{};
  const std::string time(name.substr(0, kTimeLength));  // strptime() returns a pointer into it
  const char* const end = ::strptime(time.c_str(), "%Y-%m-%dT%H-%M-%SZ", &utc);
  if (end == nullptr || *end != '\0') return std::nullopt;
  const std::int64_t seconds = ::timegm(&utc);
  constexpr std::int64_t kMaxSeconds = std::numeric_limits<std::int64_t>::max() / rt::kNsPerSecond;
  if (seconds < 0 || seconds >= kMaxSeconds) return std::nullopt;
  return seconds * rt::kNsPerSecond;
}

/// Returns the name of the trace being written to this file; empty for another file.
std::string openTraceName(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.ends_with(kPartEnding) ? name.substr(0, name.size() - kPartEnding.size()) : "";
}

/// Sets the name and the state that follow from the name of a file; returns false if it is not that of a
/// trace.
bool takeName(std::string file, TraceEntry& entry) {
  entry.open = file.ends_with(kPartEnding);
  entry.damaged = !entry.open && !file.ends_with(kEnding);
  if (entry.damaged && !recoveredFrom(file)) return false;
  if (!entry.damaged) file.resize(file.size() - (entry.open ? kPartEnding : kEnding).size());
  entry.name = std::move(file);
  return isTraceName(entry.name);
}

/// Fills `entry`; returns false if the file is not a trace, or has just been renamed or deleted.
bool describe(const fs::path& file, TraceEntry& entry) {
  struct stat status {};
  if (!takeName(file.filename().string(), entry) || ::stat(file.c_str(), &status) != 0 ||
      !S_ISREG(status.st_mode)) {
    return false;
  }
  entry.bytes = static_cast<std::uint64_t>(status.st_size);
  entry.time_ns = std::int64_t{status.st_mtim.tv_sec} * rt::kNsPerSecond + status.st_mtim.tv_nsec;
  const TraceHead head = readTraceHead(file);
  entry.depth = head.depth;
  entry.clock_is_set = head.clock_is_set;
  entry.number = head.number;
  entry.kept = has(file.parent_path(), entry.name, kKeepEnding);
  entry.note = noteOf(file);
  entry.begin_ns = beginOf(entry.name).value_or(entry.time_ns);
  return true;
}

base::Result<void> checkName(std::string_view name) {
  if (isTraceName(name)) return {};
  return base::failure({}, fmt::format("\"{}\" is not the name of a trace", name.substr(0, kMaxNameLength)),
                       "1 to 100 letters, digits, '-', '_' and '.', not beginning with '.'");
}

std::unexpected<base::Error> noSuchTrace(const fs::path& file) {
  return base::failure(file, "no such trace", "list them: hapticctl trace list");
}

}  // namespace

bool isTraceName(std::string_view name) {
  const std::size_t own_length = recoveredFrom(name).value_or(name).size();
  return own_length > 0 && own_length <= kMaxNameLength && name.front() != '.' &&
         std::ranges::all_of(name, isNameCharacter);
}

bool isDumpName(std::string_view name) {
  name = recoveredFrom(name).value_or(name);
  if (!beginOf(name)) return false;
  std::string_view label = name.substr(kTimeLength);
  if (const std::size_t dash = label.rfind('-');
      dash != std::string_view::npos && dash + 1 < label.size() &&
      label.find_first_not_of("0123456789", dash + 1) == std::string_view::npos) {
    label = label.substr(0, dash);  // number added to a name that was taken
  }
  constexpr std::array kLabels{kDumpLabel, kFaultLabel, kOverrunBurstLabel};
  return label.starts_with('-') && std::ranges::find(kLabels, label.substr(1)) != kLabels.end();
}

std::string newTraceName(const fs::path& folder, std::int64_t realtime_ns, std::string_view label) {
  constexpr std::size_t kRoomForNumber = 8;
  const auto seconds = static_cast<std::time_t>(realtime_ns / rt::kNsPerSecond);
  std::string name = fmt::format("{:%Y-%m-%dT%H-%M-%S}Z", fmt::gmtime(seconds));
  if (!label.empty())
    name += "-" + std::string(label.substr(0, kMaxNameLength - name.size() - kRoomForNumber));
  std::ranges::replace_if(
      name, [](char c) { return !isNameCharacter(c); }, '-');
  const auto taken = [&folder](const std::string& candidate) {
    return std::ranges::any_of(std::array{kEnding, kPartEnding, kKeepEnding, kNoteEnding},
                               [&](std::string_view ending) { return has(folder, candidate, ending); });
  };
  std::string candidate = name;
  for (int number = 2; taken(candidate); ++number) candidate = fmt::format("{}-{}", name, number);
  return candidate;
}

base::Result<std::vector<TraceEntry>> listTraces(const fs::path& folder) {
  std::vector<TraceEntry> traces;
  std::error_code failure;
  if (!fs::exists(folder, failure) && !failure) return traces;
  fs::directory_iterator file(folder, failure);
  for (const fs::directory_iterator end; !failure && file != end; file.increment(failure)) {
    TraceEntry entry;
    if (describe(file->path(), entry)) traces.push_back(std::move(entry));
  }
  if (failure) {
    return base::failure(folder, "cannot be read: " + failure.message(),
                         "check state.folder and its permissions");
  }
  std::ranges::sort(traces, {}, [](const TraceEntry& entry) {
    return std::tuple(entry.number, entry.begin_ns, entry.time_ns, entry.name);
  });
  return traces;
}

std::vector<std::string> openTraces(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failure;
  fs::directory_iterator file(folder, failure);
  for (const fs::directory_iterator end; !failure && file != end; file.increment(failure)) {
    if (std::string name = openTraceName(file->path()); isTraceName(name)) names.push_back(std::move(name));
  }
  return names;
}

base::Result<void> deleteTrace(const fs::path& folder, std::string_view name) {
  if (auto named = checkName(name); !named) return named;
  const fs::path file = finishedFile(folder, name);
  if (has(folder, name, kPartEnding)) return base::failure(file, "is being written", "stop the trace first");
  if (!isFinished(folder, name)) return noSuchTrace(file);
  if (has(folder, name, kKeepEnding)) {
    return base::failure(file, "is marked to be kept",
                         fmt::format("remove the mark first: hapticctl trace keep --undo {}", name));
  }
  std::error_code failure;
  fs::remove(file, failure);
  if (!failure) fs::remove(fileOf(folder, name, kNoteEnding), failure);
  if (failure) {
    return base::failure(file, "cannot be deleted: " + failure.message(),
                         "check the permissions of the folder");
  }
  return {};
}

std::string noteOf(const fs::path& trace_file) {
  std::string name = trace_file.filename().string();
  for (const std::string_view ending : {kPartEnding, kEnding}) {
    if (!name.ends_with(ending)) continue;
    name.resize(name.size() - ending.size());
    break;
  }
  const auto text =
      base::fileContent(fileOf(trace_file.parent_path(), name, kNoteEnding), {.longest = kMaxNoteLength + 1});
  return text ? base::printable(text->substr(0, text->find('\n'))) : "";
}

base::Result<void> keepTrace(const fs::path& folder, std::string_view name, bool keep) {
  if (auto named = checkName(name); !named) return named;
  const fs::path mark = fileOf(folder, name, kKeepEnding);
  const auto failed = [&] {
    return base::failure(mark,
                         fmt::format("cannot be {}: {}", keep ? "created" : "removed", std::strerror(errno)),
                         "check the space on the disk and the permissions of the folder");
  };
  if (!isFinished(folder, name) && !has(folder, name, kPartEnding)) {
    return noSuchTrace(finishedFile(folder, name));
  }
  if (keep) {
    const int descriptor = ::open(mark.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (descriptor < 0) return failed();
    ::close(descriptor);
  } else if (::unlink(mark.c_str()) != 0 && errno != ENOENT) {
    return failed();
  }
  return synchroniseFolder(folder);
}

base::Result<void> noteTrace(const fs::path& folder, std::string_view name, const std::string& text) {
  if (auto named = checkName(name); !named) return named;
  const fs::path note = fileOf(folder, name, kNoteEnding);
  if (!isFinished(folder, name) && !has(folder, name, kPartEnding)) {
    return noSuchTrace(finishedFile(folder, name));
  }
  if (text.size() > kMaxNoteLength || base::printable(text) != text) {
    return base::failure(note, "cannot hold that note",
                         fmt::format("give one line of at most {} bytes", kMaxNoteLength));
  }
  const fs::path part = note.string() + ".part";
  std::error_code failure;
  if (text.empty()) {
    fs::remove(note, failure);
  } else {
    if (std::ofstream file(part, std::ios::trunc); !(file << text << '\n').flush()) {
      failure = std::error_code(errno, std::generic_category());
    }
    if (!failure) fs::rename(part, note, failure);
  }
  if (failure) {
    std::error_code ignored;
    fs::remove(part, ignored);
    return base::failure(note, "cannot be changed: " + failure.message(),
                         "check the space on the disk and the permissions of the folder");
  }
  return synchroniseFolder(folder);
}

namespace {

/// Returns whether the trace is ordinary; the newest ordinary one is never deleted.
bool isOrdinary(const TraceEntry& trace) {
  return !trace.open && !trace.kept && !isDumpName(trace.name);
}

}  // namespace

RetentionPlan planRetention(std::span<const TraceEntry> traces, std::string_view just_finished) {
  RetentionPlan plan;
  const TraceEntry* newest = nullptr;
  for (const TraceEntry& trace : traces) {
    if (isOrdinary(trace) && !trace.damaged) newest = &trace;
  }
  for (const TraceEntry& trace : traces) {
    plan.bytes += trace.bytes;
    if (trace.kept) ++plan.kept;
    if (!trace.kept && isDumpName(trace.name)) ++plan.dumps;
    if (!isOrdinary(trace) || &trace == newest || trace.name == just_finished) {
      plan.protected_bytes += trace.bytes;
    } else {
      plan.deletable.push_back(trace);
    }
  }
  return plan;
}

}  // namespace hapticd::trace
