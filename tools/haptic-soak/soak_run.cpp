// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/soak_run.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace hapticd::tools {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{20};
constexpr double kReloadEvery_s = 0.7;
constexpr double kReloadPatience_s = 30;
constexpr int kSamples = 200;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Fixed times of an action. If several were missed, the action is due once.
class Schedule {
 public:
  explicit Schedule(double period_s) : period_s_(period_s), next_s_(period_s) {}
  bool due(double now_s) {
    if (now_s < next_s_) return false;
    next_s_ = now_s + period_s_;
    return true;
  }

 private:
  double period_s_;
  double next_s_;
};

/// The daemon, the clients and the clock.
class Soak {
 public:
  Soak(const SoakOptions& options, const Interrupt& interrupt, DaemonProcess& daemon)
      : options_(options),
        interrupt_(interrupt),
        daemon_(daemon),
        reload_(kReloadEvery_s),
        replug_(options.replug_every_s),
        sample_(options.seconds / kSamples) {}

  SoakResult run(const std::function<void(double)>& progress) {
    useOnce();
    result_.before = settled();
    begin_ = Clock::now();
    {
      SoakClients clients(
          {daemon_.statusSocket(), daemon_.controlSocket(), options_.hapticctl.string(), options_.seed});
      takeSample();
      while (goesOn()) {
        step();
        progress(secondsSince(begin_));
        std::this_thread::sleep_for(kLook);
      }
      takeSample();
      result_.clients = clients.stop();
    }
    replug_command_.reset();
    finish();
    return std::move(result_);
  }

 private:
  bool goesOn() {
    result_.interrupted = interrupt_.requested();
    return !result_.interrupted && daemon_.running() && secondsSince(begin_) < options_.seconds;
  }

  void step() {
    const double now_s = secondsSince(begin_);
    if (reload_.due(now_s)) daemon_.reload(static_cast<ReloadKind>(result_.reloads++ % 3));
    if (sample_.due(now_s)) takeSample();
    replugIfDue(now_s);
  }

  void replugIfDue(double now_s) {
    if (replug_command_) {
      const auto ending = replug_command_->ending();
      if (!ending) return;
      result_.failed_replugs += ending->good() ? 0U : 1U;
      replug_command_.reset();
    }
    if (options_.on_replug.empty() || !replug_.due(now_s)) return;
    ++result_.replugs;
    auto started = ChildProcess::start({"/bin/sh", "-c", options_.on_replug},
                                       {.environment = {"HAPTICD_PID=" + std::to_string(daemon_.pid())}}, "");
    if (started) replug_command_.emplace(std::move(*started));
    result_.failed_replugs += started ? 0U : 1U;
  }

  void takeSample() {
    auto sample = sampleProcess(daemon_.pid());
    if (!sample) return;
    sample->time_s = secondsSince(begin_);
    result_.samples.push_back(*sample);
  }

  /// Uses functions once whose resources the daemon keeps, so that they do not count as growth: the memory of
  /// the first trace, which any burst of overruns may make it write, and the threads for files. Dumping is
  /// refused when there is no flight recorder; then nothing dumps by itself either.
  void useOnce() {
    auto client = VarlinkClient::connect(daemon_.controlSocket());
    if (client) (void)client->call("io.hapticd.Control.DumpTrace");
    if (client) (void)client->call("io.hapticd.Status.ListTraces");
    daemon_.reload(ReloadKind::same);
    const auto begin = Clock::now();
    while (daemon_.running() && secondsSince(begin) < kReloadPatience_s &&
           daemon_.lastWords().find("configuration reloaded") == std::string::npos) {
      std::this_thread::sleep_for(kLook);
    }
  }

  /// Samples the process after all connections were closed: the smallest number of descriptors within a
  /// while.
  ProcessSample settled() const {
    ProcessSample best;
    const auto begin = Clock::now();
    while (secondsSince(begin) < 1) {
      const auto sample = sampleProcess(daemon_.pid());
      if (sample && (best.threads == 0 || sample->descriptors <= best.descriptors)) best = *sample;
      std::this_thread::sleep_for(kLook);
    }
    return best;
  }

  void finish() {
    if (!daemon_.running()) {
      result_.early_ending = daemon_.stop();
      result_.last_words = daemon_.lastWords();
      return;
    }
    result_.after = settled();
    readStatus();
    result_.ending = daemon_.stop();
    if (!result_.ending || !result_.ending->good()) result_.last_words = daemon_.lastWords();
  }

  void readStatus() {
    auto client = VarlinkClient::connect(daemon_.statusSocket());
    auto reply = client ? client->call("io.hapticd.Status.GetStatus") : std::unexpected(client.error());
    if (reply) {
      result_.status = (*reply)["status"];
    } else {
      result_.status_error = reply.error().what;
    }
  }

  const SoakOptions& options_;
  const Interrupt& interrupt_;
  DaemonProcess& daemon_;
  Schedule reload_;
  Schedule replug_;
  Schedule sample_;
  Clock::time_point begin_;
  std::optional<ChildProcess> replug_command_;
  SoakResult result_;
};

}  // namespace

config::Result<SoakResult> runSoak(const SoakOptions& options, const Interrupt& interrupt,
                                   const std::function<void(double)>& progress) {
  const ScratchFolder folder;
  auto daemon = DaemonProcess::start(folder, options.daemon, options.config_file, options.assignments);
  if (!daemon) return std::unexpected(daemon.error());
  return Soak(options, interrupt, *daemon).run(progress);
}

}  // namespace hapticd::tools
