// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/retention.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "daemon/trace/mcap/trace_file.h"
#include "daemon/trace/recovery/trace_recovery.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

constexpr double kBytesPerMb = 1e6;
/// Space for the start of a trace: schemas and settings take about 50 kB, a second of uncompressed ticks 0.7
/// MB.
constexpr std::uint64_t kMinToBegin_bytes = 1'000'000;

}  // namespace

std::uint64_t bytesOf(double megabytes) {
  return static_cast<std::uint64_t>(megabytes * kBytesPerMb);
}

std::string megabytes(std::uint64_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / kBytesPerMb);
}

DiskSpace::DiskSpace(std::filesystem::path folder, double min_free_mb)
    : folder_(std::move(folder)), least_bytes_(bytesOf(min_free_mb)) {}

void DiskSpace::measure() {
  std::error_code failure;
  const std::filesystem::space_info space = std::filesystem::space(folder_, failure);
  free_bytes_ = failure ? std::nullopt : std::optional<std::uint64_t>(space.available);
}

base::Result<void> DiskSpace::enoughToBegin() const {
  return enough(std::max(least_bytes_, kMinToBegin_bytes));
}

base::Result<void> DiskSpace::enough(std::uint64_t least_bytes) const {
  if (!free_bytes_ || *free_bytes_ >= least_bytes) return {};
  const char* const why =
      least_bytes == least_bytes_ ? "trace.min_free_mb asks for" : "a trace takes at its begin";
  return std::unexpected(
      base::Error{folder_.string(),
                  fmt::format("only {} are free, less than the {} that {}", megabytes(*free_bytes_),
                              megabytes(least_bytes), why),
                  "delete traces (hapticctl trace list, trace delete), or lower trace.min_free_mb"});
}

namespace {

/// How often the folder is listed without a known change, because the open trace grows and others may delete.
/// More often with a limit, because recording stops there.
constexpr std::chrono::seconds kListPeriod{60};
constexpr std::chrono::seconds kListPeriodWithLimit{10};

std::uint64_t mostFileBytes(const config::TraceSettings& settings) {
  constexpr double kShareOfLimit = 0.25;
  const double most_mb = settings.max_folder_mb > 0
                             ? std::min(settings.max_file_mb, kShareOfLimit * settings.max_folder_mb)
                             : settings.max_file_mb;
  return bytesOf(most_mb);
}

base::Result<void> resultOf(const std::optional<base::Error>& refusal) {
  if (refusal) return std::unexpected(*refusal);
  return {};
}

}  // namespace

Retention::Retention(std::filesystem::path folder, const config::TraceSettings& settings,
                     OnDeleted on_deleted)
    : folder_(std::move(folder)),
      limit_bytes_(bytesOf(settings.max_folder_mb)),
      most_file_bytes_(daemon::mostFileBytes(settings)),
      on_deleted_(std::move(on_deleted)) {
  if (limit_bytes_ > 0) status_.limit_bytes = limit_bytes_;
}

Retention::~Retention() {
  stop();
}

base::Result<void> Retention::start() {
  auto thread = drivers::startThread("trace-retention", [this] { run(); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void Retention::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

bool Retention::stopping() const {
  const std::lock_guard lock(mutex_);
  return stop_;
}

void Retention::requestList() {
  {
    const std::lock_guard lock(mutex_);
    due_ = true;
  }
  wake_.notify_all();
}

void Retention::requestListAfter(const std::string& finished) {
  {
    const std::lock_guard lock(mutex_);
    just_finished_ = finished;
  }
  requestList();
}

void Retention::awaitFirstList(std::chrono::seconds patience) {
  if (limit_bytes_ == 0) return;
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, patience, [this] { return looked_ || stop_; });
}

base::Result<void> Retention::mayBegin() const {
  const std::lock_guard lock(mutex_);
  return resultOf(begin_refusal_);
}

base::Result<void> Retention::mayGoOn() const {
  const std::lock_guard lock(mutex_);
  return resultOf(go_on_refusal_);
}

Retention::Status Retention::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Retention::run() {
  const auto period = limit_bytes_ > 0 ? kListPeriodWithLimit : kListPeriod;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, period, [this] { return stop_ || due_; });
      if (stop_) return;
      due_ = false;
    }
    lookNow();
  }
}

void Retention::lookNow() {
  const auto traces = trace::listTraces(folder_);
  std::string just_finished;
  {
    const std::lock_guard lock(mutex_);
    just_finished = just_finished_;
  }
  if (!traces) {
    const std::lock_guard lock(mutex_);
    status_.problems = {traces.error().text()};
    return;
  }
  trace::RetentionPlan plan = trace::planRetention(*traces, just_finished);
  if (limit_bytes_ > 0 && plan.bytes > limit_bytes_) {
    deleteDown(plan);
  } else {
    publish(plan, {});
  }
}

/// A trace that cannot be deleted counts as protected, so that recording stops at the limit in any case.
void Retention::deleteDown(trace::RetentionPlan& plan) {
  std::vector<std::string> problems;
  while (plan.bytes > limit_bytes_ && !plan.deletable.empty() && !stopping()) {
    const trace::TraceEntry trace = plan.deletable.front();
    const auto deleted = trace::deleteTrace(folder_, trace.name);
    plan.deletable.erase(plan.deletable.begin());
    if (!deleted) {
      plan.protected_bytes += trace.bytes;
      problems.push_back("trace.max_folder_mb: " + deleted.error().text());
      continue;
    }
    on_deleted_(trace.name,
                fmt::format("the traces took {}, more than trace.max_folder_mb allows, and it was the oldest",
                            megabytes(plan.bytes)));
    plan.bytes -= trace.bytes;
    {
      const std::lock_guard lock(mutex_);
      ++status_.deleted;
    }
    publish(plan, problems);
  }
  publish(plan, problems);
}

void Retention::publish(const trace::RetentionPlan& plan, std::vector<std::string> problems) {
  if (std::string warning = warningOf(plan); !warning.empty()) problems.push_back(std::move(warning));
  {
    const std::lock_guard lock(mutex_);
    looked_ = true;
    status_.folder_bytes = plan.bytes;
    status_.next = limit_bytes_ > 0 && !plan.deletable.empty() ? plan.deletable.front().name : "";
    status_.problems = std::move(problems);
    begin_refusal_ = refusalAbove(limit_bytes_ - limit_bytes_ / 10, plan);
    go_on_refusal_ = refusalAbove(limit_bytes_, plan);
  }
  wake_.notify_all();
}

/// The warning about a full folder, from nine tenths of the limit on, or earlier if one more file of the
/// largest size would reach the limit.
std::string Retention::warningOf(const trace::RetentionPlan& plan) const {
  if (limit_bytes_ == 0) return "";
  const std::uint64_t room = std::max(limit_bytes_ / 10, most_file_bytes_);
  if (plan.bytes + room < limit_bytes_) return "";
  const std::string filled = fmt::format("the traces take {} of the {} that trace.max_folder_mb allows",
                                         megabytes(plan.bytes), megabytes(limit_bytes_));
  if (plan.deletable.empty()) {
    return filled +
           ", and none of them may be deleted by itself: recording stops there (delete traces that are not "
           "needed, or raise trace.max_folder_mb)";
  }
  return fmt::format("{}: {} is deleted next (hapticctl trace keep {} keeps it)", filled,
                     plan.deletable.front().name, plan.deletable.front().name);
}

std::optional<base::Error> Retention::refusalAbove(std::uint64_t most_bytes,
                                                   const trace::RetentionPlan& plan) const {
  if (limit_bytes_ == 0 || plan.protected_bytes <= most_bytes) return std::nullopt;
  return base::Error{
      folder_.string(),
      fmt::format(
          "{} of the {} that trace.max_folder_mb allows are protected from deletion: {} traces marked "
          "to be kept, {} of the flight recorder, the newest one, and what is not finished",
          megabytes(plan.protected_bytes), megabytes(limit_bytes_), plan.kept, plan.dumps),
      "delete traces (hapticctl trace list, trace delete), take marks away (trace keep --undo), or raise "
      "trace.max_folder_mb"};
}

base::Result<void> CrashRecovery::begin() {
  const std::vector<std::string> left_open = trace::openTraces(folder_);
  if (left_open.empty()) return {};
  auto thread = drivers::startThread("trace-recovery", [this, left_open] { finish(left_open); });
  if (!thread) return std::unexpected(thread.error());
  thread_ = std::move(*thread);
  return {};
}

void CrashRecovery::stop() {
  stops_ = true;
  if (thread_.joinable()) thread_.join();
}

CrashRecovery::Status CrashRecovery::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void CrashRecovery::finish(const std::vector<std::string>& names) {
  using Outcome = trace::RecoveredTrace::Outcome;
  for (const std::string& name : names) {
    const auto finished =
        trace::finishTrace(trace::partOf(folder_ / (name + ".mcap")), [this](double) { return !stops_; });
    if (!finished && stops_) return;  // the next start goes on
    const bool holds_nothing =
        finished && (finished->outcome == Outcome::empty || finished->outcome == Outcome::hopeless);
    if (holds_nothing) {
      news_(
          {0, true, "lose", name,
           fmt::format("trace {} was cut off by a crash before its first ticks were on the disk: nothing of "
                       "it could be recovered",
                       name)});
    }
    changed_();
    const std::lock_guard lock(mutex_);
    auto& [recovered, problems] = status_;
    if (!finished) {
      problems.push_back("recovery: " + finished.error().text());
    } else if (finished->outcome == Outcome::hopeless) {
      problems.push_back(
          fmt::format("recovery: nothing whole is in {} (hapticctl trace delete {} deletes it)",
                      finished->original.string(), finished->original.filename().string()));
    } else if (!holds_nothing) {
      ++recovered;
      if (finished->outcome != Outcome::rewritten) continue;
      problems.push_back(
          fmt::format("recovery: {} was damaged: {} bytes of it could not be kept in {} (hapticctl "
                      "trace delete {} deletes the damaged original)",
                      finished->original.string(), finished->bytes_lost, finished->file.string(),
                      finished->original.filename().string()));
    }
  }
}

}  // namespace hapticd::daemon
