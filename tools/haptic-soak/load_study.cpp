// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-soak/load_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <thread>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {
namespace {

using std::chrono::milliseconds;

config::Error errorOf(const ClientError& error) {
  return {"hapticd", error.what, error.remedy};
}

/// Clients with a thread each, from construction to destruction.
class Crowd {
 public:
  Crowd(const std::string& socket, int clients, Load load, LoadResult& result)
      : calls_(0), unanswered_(0), result_(result) {
    for (int i = 0; load != Load::none && i < clients; ++i) {
      threads_.emplace_back([this, socket, load](const std::stop_token& stop) { work(socket, load, stop); });
    }
  }
  ~Crowd() {
    for (std::jthread& thread : threads_) thread.request_stop();
    threads_.clear();
    result_.calls += calls_;
    result_.unanswered += unanswered_;
  }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

 private:
  void work(const std::string& socket, Load load, const std::stop_token& stop) {
    auto client = VarlinkClient::connect(socket);
    const bool watches = load == Load::tracing;
    if (client && watches && !client->subscribe("io.hapticd.Status.Monitor", {{"intervalMs", 20}}))
      ++unanswered_;
    while (client && !stop.stop_requested()) {
      const auto reply =
          watches ? client->next(VarlinkClient::kTimeLimit) : client->call("io.hapticd.Status.GetStatus");
      reply&& fieldAt(*reply, "status") ? ++calls_ : ++unanswered_;
      if (!reply) return;
    }
    if (!client) ++unanswered_;
  }

  std::atomic<std::uint64_t> calls_;  // relaxed would do: read after the threads have ended
  std::atomic<std::uint64_t> unanswered_;
  LoadResult& result_;
  std::vector<std::jthread> threads_;
};

class LoadStudy {
 public:
  LoadStudy(const LoadOptions& options, DaemonProcess& daemon) : options_(options), daemon_(daemon) {}

  config::Result<LoadResult> run(const Interrupt& interrupt, const std::function<void(double)>& progress) {
    double done_s = 0;
    for (int round = 0; round < options_.rounds && !interrupt.requested(); ++round) {
      for (const Load load : {Load::none, Load::hammering, Load::tracing}) {
        if (auto measured = measure(load); !measured) return std::unexpected(measured.error());
        progress(done_s += options_.round_s);
      }
    }
    auto client = VarlinkClient::connect(daemon_.statusSocket());
    auto reply = client ? client->call("io.hapticd.Status.GetStatus") : std::unexpected(client.error());
    if (!reply) return std::unexpected(errorOf(reply.error()));
    result_.status = (*reply)["status"];
    return std::move(result_);
  }

 private:
  config::Result<Json> control(const std::string& method) {
    auto client = VarlinkClient::connect(daemon_.controlSocket());
    auto reply = client ? client->call("io.hapticd.Control." + method) : std::unexpected(client.error());
    if (!reply) return std::unexpected(errorOf(reply.error()));
    return *reply;
  }

  config::Result<void> measure(Load load) {
    if (load == Load::tracing) {
      if (auto started = control("StartTrace"); !started) return std::unexpected(started.error());
    }
    config::Result<Json> window;
    {
      const Crowd crowd(daemon_.statusSocket(), options_.clients, load, result_);
      window = windowOf();
    }
    if (load == Load::tracing) {
      noteTraceSize();
      if (auto stopped = control("StopTrace"); !stopped) return std::unexpected(stopped.error());
    }
    if (!window) return std::unexpected(window.error());
    addRound(load, *window);
    return {};
  }

  /// Returns the window of a stream whose second reply arrives after one round; the first reply resets the
  /// window.
  config::Result<Json> windowOf() {
    const auto interval_ms = static_cast<int>(options_.round_s * 1000);
    auto client = VarlinkClient::connect(daemon_.controlSocket());
    if (!client) return std::unexpected(errorOf(client.error()));
    if (auto subscribed = client->subscribe("io.hapticd.Status.Monitor", {{"intervalMs", interval_ms}});
        !subscribed) {
      return std::unexpected(errorOf(subscribed.error()));
    }
    auto reply = client->next(VarlinkClient::kTimeLimit);
    if (reply) reply = client->next(milliseconds(interval_ms) + VarlinkClient::kTimeLimit);
    if (!reply) return std::unexpected(errorOf(reply.error()));
    return (*reply)["window"];
  }

  void addRound(Load load, const Json& window) {
    const auto us = [&window](const char* path) { return numberAt(window, path) / 1000; };
    result_.rounds.push_back({load, static_cast<std::uint64_t>(numberAt(window, "ticks")),
                              us("wakeupLatency.p50Ns"), us("wakeupLatency.p99Ns"),
                              us("wakeupLatency.p999Ns"), us("wakeupLatency.maxNs"),
                              us("computeTime.p99Ns")});
  }

  void noteTraceSize() {
    auto client = VarlinkClient::connect(daemon_.statusSocket());
    const auto reply = client ? client->call("io.hapticd.Status.GetStatus") : std::unexpected(client.error());
    if (!reply) return;
    constexpr double kSecondsPerHour = 3600;
    result_.trace_bytes_per_hour =
        numberAt(*reply, "status.trace.bytes") / numberAt(*reply, "status.trace.durationS") * kSecondsPerHour;
  }

  const LoadOptions& options_;
  DaemonProcess& daemon_;
  LoadResult result_;
};

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double medianOf(const LoadResult& result, Load load, double LoadRound::*value) {
  std::vector<double> values;
  for (const LoadRound& round : result.rounds) {
    if (round.load == load) values.push_back(round.*value);
  }
  return median(std::move(values));
}

double largestOf(const LoadResult& result, Load load, double LoadRound::*value) {
  double largest = 0;
  for (const LoadRound& round : result.rounds) {
    if (round.load == load) largest = std::max(largest, round.*value);
  }
  return largest;
}

constexpr const char* kLosses[] = {"loop.traceTicksDropped", "loop.pageFaults", "loop.counters.overruns",
                                   "trace.ticksLost", "trace.recordsLost"};

}  // namespace

const char* nameOf(Load load) {
  switch (load) {
    case Load::none:
      return "none";
    case Load::hammering:
      return "hammering";
    case Load::tracing:
      return "tracing";
  }
  return "none";
}

config::Result<LoadResult> studyLoad(const LoadOptions& options, const Interrupt& interrupt,
                                     const std::function<void(double)>& progress) {
  const ScratchFolder folder;
  auto daemon =
      DaemonProcess::start(folder, options.soak.daemon, options.soak.config_file, options.soak.assignments);
  if (!daemon) return std::unexpected(daemon.error());
  auto result = LoadStudy(options, *daemon).run(interrupt, progress);
  daemon->stop();
  return result;
}

std::string loadTable(const LoadResult& result) {
  std::string text =
      "load       rounds  wake-up p50    p99  p99.9  ratio     max  compute p99   (us; medians over the "
      "rounds)\n";
  const double reference = medianOf(result, Load::none, &LoadRound::wakeup_p999_us);
  for (const Load load : {Load::none, Load::hammering, Load::tracing}) {
    const double p999 = medianOf(result, load, &LoadRound::wakeup_p999_us);
    text += fmt::format("{:<10} {:>6} {:>12.1f} {:>6.1f} {:>6.1f} {:>6.2f} {:>7.1f} {:>12.1f}\n",
                        nameOf(load), std::ranges::count(result.rounds, load, &LoadRound::load),
                        medianOf(result, load, &LoadRound::wakeup_p50_us),
                        medianOf(result, load, &LoadRound::wakeup_p99_us), p999, p999 / reference,
                        largestOf(result, load, &LoadRound::wakeup_max_us),
                        medianOf(result, load, &LoadRound::compute_p99_us));
  }
  text += fmt::format("\n{} calls answered, {} not; trace {:.0f} MB per hour\n", result.calls,
                      result.unanswered, result.trace_bytes_per_hour / 1e6);
  for (const char* path : kLosses) text += fmt::format("{}: {}\n", path, countAt(result.status, path));
  return text;
}

std::string loadJson(const LoadResult& result) {
  Json rounds = Json::array();
  for (const LoadRound& round : result.rounds) {
    const auto& [load, ticks, p50, p99, p999, max, compute_p99] = round;
    rounds.push_back({{"load", nameOf(load)},
                      {"ticks", ticks},
                      {"wakeupP50Us", p50},
                      {"wakeupP99Us", p99},
                      {"wakeupP999Us", p999},
                      {"wakeupMaxUs", max},
                      {"computeP99Us", compute_p99}});
  }
  const Json document = {{"rounds", rounds},
                         {"calls", result.calls},
                         {"unanswered", result.unanswered},
                         {"traceBytesPerHour", result.trace_bytes_per_hour},
                         {"status", result.status}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
