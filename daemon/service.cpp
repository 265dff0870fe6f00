// SPDX-License-Identifier: Apache-2.0
#include "daemon/service.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "daemon/base/journal_entry.h"
#include "daemon/control/server/listening_socket.h"
#include "daemon/journal.h"
#include "drivers/base/start_thread.h"

namespace hapticd::daemon {
namespace {

/// Changes of state that may wait; the first to be dropped is the oldest.
constexpr std::size_t kMaxWaiting = 16;

}  // namespace

ServiceManager::ServiceManager() {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    sockets_.emplace(names[i], SD_LISTEN_FDS_START + i);
    std::free(names[i]);
  }
  std::free(names);

  std::uint64_t watchdog_us = 0;
  if (::sd_watchdog_enabled(0, &watchdog_us) > 0) feed_period_ = std::chrono::microseconds(watchdog_us / 4);
  if (const char* const address = std::getenv("NOTIFY_SOCKET")) connectTo(address);
}

/// `address`: a path or, from '@' on, a name in the abstract namespace.
void ServiceManager::connectTo(std::string address) {
  if (address.size() < 2 || address.size() >= sizeof address_.sun_path) return;
  const bool abstract = address[0] == '@';
  address_.sun_family = AF_UNIX;
  address.copy(address_.sun_path, address.size());
  if (abstract) address_.sun_path[0] = '\0';
  address_bytes_ =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size() + (abstract ? 0 : 1));
  socket_ = base::Descriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

int ServiceManager::takeSocket(const std::string& name) {
  const auto found = sockets_.extract(name);
  return found ? found.mapped() : -1;
}

ServiceManager::Sent ServiceManager::trySend(const std::string& message) const {
  ssize_t sent = -1;
  do {
    sent = ::sendto(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                    reinterpret_cast<const sockaddr*>(&address_), address_bytes_);
  } while (sent < 0 && errno == EINTR);
  if (sent >= 0) return Sent::done;
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS ? Sent::full : Sent::failed;
}

void ServiceManager::send(std::string message) {
  if (!socket_) return;
  sendWaiting();
  waiting_.push_back(std::move(message));
  sendWaiting();
  if (waiting_.size() <= kMaxWaiting) return;
  waiting_.pop_front();
  ++lost_;
}

void ServiceManager::sendWaiting() {
  while (!waiting_.empty()) {
    const Sent sent = trySend(waiting_.front());
    if (sent == Sent::full) return;
    if (sent == Sent::failed) ++lost_;
    waiting_.pop_front();
  }
}

void ServiceManager::ready() {
  send("READY=1");
}

void ServiceManager::reloading() {
  const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch());
  send(fmt::format("RELOADING=1\nMONOTONIC_USEC={}", now_us.count()));
}

void ServiceManager::stopping() {
  send("STOPPING=1\nSTATUS=stopping");
}

void ServiceManager::showState(const std::string& line) {
  if (line == state_) return;
  state_ = line;
  constexpr const char* kField = "STATUS=";
  // Of those that wait only the newest one has a meaning.
  std::erase_if(waiting_, [](const std::string& message) { return message.starts_with(kField); });
  send(kField + line);
}

void ServiceManager::feedWatchdog(std::uint64_t heartbeat, Clock::time_point now) {
  if (!socket_) return;
  sendWaiting();
  if (feed_period_ == Clock::duration::zero() || heartbeat == last_heartbeat_ ||
      now - last_fed_ < feed_period_)
    return;
  const bool fed = trySend("WATCHDOG=1") == Sent::done;
  if (!fed && !std::exchange(feed_failed_, true)) ++lost_;
  if (!fed) return;
  feed_failed_ = false;
  last_heartbeat_ = heartbeat;
  last_fed_ = now;
}

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

int fail(const base::Error& error, int status) {
  writeToJournal({Priority::error, error.text()});
  return status;
}

}  // namespace

Service::Service(const StartSettings& start, ConfigurationSource source,
                 std::unique_ptr<FaultInjector> faults)
    : box_(start.settings, std::move(faults)),
      reloader_(box_, start, std::move(source), [this](const JournalEntry& entry) { report(entry); }),
      control_(box_, {.log = [this](const JournalEntry& entry) { report(entry); },
                      .calibration = {start.configured_T_world_camera, start.registration},
                      .reloads = &reloader_}),
      events_([this](const JournalEntry& entry) { report(entry); }) {
  reloader_.reportSummary(start.summary);
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

base::Result<void> Service::openSockets() {
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
  reloader_.periodic(
      now, [this] { manager_.reloading(); }, [this] { manager_.ready(); });
  if (reloader_.pending() != box_.pendingReload()) showNotices();
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
  box_.setLimitedPoses(control_.limitedPoses());
}

void Service::checkForChanges(Clock::time_point now) {
  next_look_ = now + kLookPeriod;
  showNotices();
  const BoxStatus status = box_.status();
  events_.onStatus(status);
  manager_.showState(
      fmt::format("{}, camera {}, {}", nameOf(status.loop.state.tick.mode), nameOf(status.camera.state),
                  status.warnings.empty() ? "no warnings" : "see hapticctl status for warnings"));
}

void Service::showNotices() {
  box_.setPendingReload(reloader_.pending());
  std::vector<std::string> notices = reloader_.warnings();
  if (const JournalStatus journal = journalStatus(); journal.waits >= kLogPatience) {
    notices.push_back(fmt::format(
        "the log has not been read for {} s, {} entries are lost (press Ctrl-Q in the terminal of "
        "hapticd, or look at what reads its standard error)",
        std::chrono::floor<std::chrono::seconds>(journal.waits).count(), journal.lost));
  }
  for (std::string& warning : control_.warnings()) notices.push_back(std::move(warning));
  box_.setNotices(std::move(notices));
}

}  // namespace hapticd::daemon
