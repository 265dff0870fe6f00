// SPDX-License-Identifier: Apache-2.0
#include "daemon/service.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include <algorithm>
#include <utility>

#include "daemon/base/names.h"
#include "daemon/control/addition_change.h"
#include "daemon/control/peer.h"
#include "daemon/journal.h"
#include "daemon/reload.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

using Priority = JournalEntry::Priority;
using config::EventKind;

/// How often the control thread takes the ticks out of the ring, which holds several seconds of them.
constexpr std::chrono::milliseconds kControlPeriod{5};
/// The same while nobody is connected: then only LEDs, journal and watchdog wait for it.
constexpr std::chrono::milliseconds kIdlePeriod{20};
/// For how long a reader of the log may pause without a warning.
constexpr std::chrono::seconds kLogPatience{2};
/// How often it looks for changes that nobody requested.
constexpr std::chrono::milliseconds kLookPeriod{200};

int fail(const config::Error& error, int status) {
  writeToJournal({Priority::error, error.text()});
  return status;
}

}  // namespace

Service::Service(const StartSettings& start, ConfigurationSource source,
                 std::unique_ptr<FaultInjector> faults)
    : source_(std::move(source)),
      pose_registered_(start.registration.has_value()),
      notices_(start.notices),
      reader_(
          [source = source_] {
            return startSettings(source.file, source.overrides, config::FileKind::regular);
          },
          source_.file.string()),
      box_(start.settings, std::move(faults)),
      control_(box_, {.log = [this](const JournalEntry& entry) { report(entry); },
                      .calibration = {start.configured_T_world_camera, start.registration}}),
      events_([this](const JournalEntry& entry) { report(entry); }) {
  reportSummary(start.summary);
  if (start.boot_profile) {
    report({Priority::notice,
            "starts with the boot profile " + *start.boot_profile,
            EventKind::profile,
            {{"ACTION", "start"}, {"PROFILE", *start.boot_profile}}});
  }
}

void Service::requestStop() noexcept {
  stop_requested_ = true;
  if (VarlinkServer* const server = serving_) server->requestStop();
}

int Service::run() {
  if (auto opened = openSockets(); !opened) return fail(opened.error(), EX_UNAVAILABLE);
  auto lock = StateLock::take(box_.settings().state.folder);
  if (!lock) return fail(lock.error(), EX_UNAVAILABLE);
  state_lock_ = std::move(*lock);
  serving_ = server_.get();
  if (stop_requested_) server_->requestStop();
  if (auto started = startBox(); !started) {
    return fail(started.error().error, started.error().permanent ? EX_CONFIG : EX_OSERR);
  }
  checkForChanges(Clock::now());
  manager_.ready();
  last_period_ = Clock::now();
  server_->run(kControlPeriod, [this] { periodic(); });
  manager_.stopping();
  box_.stop();
  serving_ = nullptr;
  return EX_OK;
}

/// Also the threads that libraries create receive no signals.
std::expected<void, RunningBox::StartFailure> Service::startBox() {
  const drivers::BlockedSignals blocked;
  return box_.start();
}

config::Result<void> Service::openSockets() {
  const config::ControlSettings& settings = box_.settings().control;
  ServerOptions options;
  options.listeners.push_back(
      {Access::read, settings.status_socket, 0666, "", manager_.takeSocket("status")});
  options.listeners.push_back(
      {Access::control, settings.control_socket, 0660, "haptic", manager_.takeSocket("control")});
  options.view_group = groupNamed("haptic-view");
  options.idle_period = kIdlePeriod;
  auto server = VarlinkServer::create(options, control_);
  if (!server) return std::unexpected(server.error());
  server_ = std::move(*server);
  return {};
}

void Service::report(const JournalEntry& entry) {
  writeToJournal(entry);
  control_.onEvent(entry);
  box_.onEvent(entry);
}

void Service::periodic() {
  const Clock::time_point now = Clock::now();
  noteControl(now);
  box_.drainTicks([this, now](const rt::Tick& tick) {
    control_.onTick(tick);
    events_.onTick(tick, now);
  });
  control_.periodic(*server_);
  manager_.feedWatchdog(box_.heartbeat(), now);
  reload(now);
  if (now >= next_look_) checkForChanges(now);
}

void Service::noteControl(Clock::time_point now) {
  const auto gap = std::chrono::nanoseconds(now - std::exchange(last_period_, now)).count();
  control_status_.longest_gap_ns = std::max(control_status_.longest_gap_ns, gap);
  control_status_.connections = server_->connections();
  control_status_.refused_connections = server_->refused();
  control_status_.log_entries_lost = journalStatus().lost;
  control_status_.notifications_lost = manager_.lost();
  box_.setControlStatus(control_status_);
  box_.setFeedStatus(control_.feedStatus());
}

void Service::checkForChanges(Clock::time_point now) {
  next_look_ = now + kLookPeriod;
  showNotices();
  const BoxStatus status = box_.status();
  events_.onStatus(status);
  manager_.showState(
      fmt::format("{}, camera {}, {}", nameOf(status.loop.tick.mode), nameOf(status.camera.state),
                  status.warnings.empty() ? "no warnings" : "see hapticctl status for warnings"));
}

void Service::showNotices() {
  std::vector<std::string> notices = notices_;
  if (const JournalStatus journal = journalStatus(); journal.waits >= kLogPatience) {
    notices.push_back(fmt::format(
        "the log has not been read for {} s, {} entries are lost (press Ctrl-Q in the terminal of "
        "hapticd, or look at what reads its standard error)",
        std::chrono::floor<std::chrono::seconds>(journal.waits).count(), journal.lost));
  }
  for (std::string& warning : control_.warnings()) notices.push_back(std::move(warning));
  box_.setNotices(std::move(notices));
}

void Service::reload(Clock::time_point now) {
  if (const auto loaded = reader_.outcome(now)) {
    *loaded ? applyReload(**loaded) : refuseReload(loaded->error());
    manager_.ready();
  }
  if (!reader_.reading() && reload_requested_.exchange(false)) {
    manager_.reloading();
    reader_.begin(now);
  }
}

void Service::reportSummary(const config::SettingsSummary& summary) {
  report({Priority::notice,
          fmt::format("configuration {}: {}", source_.file.string(), summary.text()),
          EventKind::configuration,
          {{"PARAMETERS_SET", fmt::to_string(summary.set)},
           {"PARAMETERS_CHANGED", fmt::to_string(summary.differences.size())},
           {"CHANGES", summary.differencesText()}}});
}

void Service::applyReload(const StartSettings& loaded) {
  config::Settings settings = loaded.settings;
  // A registered pose that waits for the next start has a warning of its own, so it is not listed with the
  // lines of the file.
  if (pose_registered_ || loaded.registration) settings.camera.pose = box_.settings().camera.pose;
  const auto reload = reloaded(box_.settings(), settings);
  if (!reload) return refuseReload(reload.error());
  const auto differences = differencesOf(box_.additions(), reload->settings.additions);
  box_.apply(reload->settings);
  for (const Reload::Change& change : reload->changes) {
    report({Priority::notice,
            fmt::format("reload sets {} from {} to {}", change.name, change.old_value, change.new_value),
            EventKind::parameter,
            {{"PARAMETER", std::string(change.name)}, {"OLD", change.old_value}, {"NEW", change.new_value}}});
  }
  for (const AdditionDifference& difference : differences) {
    report({Priority::notice, "by reload " + difference.text(), difference.kind, difference.fields()});
  }
  notices_ = loaded.notices;
  if (!reload->waiting.empty()) {
    notices_.push_back(fmt::format("{} of {} takes effect at the next start only (systemctl restart hapticd)",
                                   fmt::join(reload->waiting, ", "), source_.file.string()));
  }
  showNotices();
  report({Priority::notice,
          fmt::format("configuration reloaded from {}: {} parameters changed, {} wait for the next start",
                      source_.file.string(), reload->changes.size(), reload->waiting.size()),
          EventKind::reload,
          {}});
  reportSummary(loaded.summary);
}

void Service::refuseReload(const std::vector<config::Error>& errors) {
  for (const config::Error& error : errors) {
    report({Priority::error, "reload refused: " + error.text(), EventKind::reload, {}});
  }
  notices_ = {fmt::format("the configuration was not reloaded, nothing changed; {} problems, the first: {}",
                          errors.size(), errors.front().text())};
  showNotices();
}

}  // namespace hapticd::daemon
