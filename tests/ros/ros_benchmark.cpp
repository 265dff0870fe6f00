// SPDX-License-Identifier: Apache-2.0
// What hapticd-ros costs and how late it is: the whole box, and subscribers of another vendor's DDS. A
// program of its own, not a test: it measures the machine.
#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "rt/base/clock.h"
#include "tests/ros/fast_dds_peer.h"
#include "tests/ros/ros_listener.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

struct Options {
  int seconds = 60;
  int rate_hz = 1000;
  int subscribers = 1;
  bool clouds = false;
};

/// CPU time and memory of a process.
struct Usage {
  double cpu_s = 0;
  double resident_mib = 0;
};
Usage usageOf(pid_t pid) {
  std::ifstream stat(fmt::format("/proc/{}/stat", pid));
  std::string text((std::istreambuf_iterator<char>(stat)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::vector<std::string> all((std::istream_iterator<std::string>(fields)), {});
  // utime, stime and rss of proc(5), whose third field is the first here
  return {(std::stod(all.at(11)) + std::stod(all.at(12))) / static_cast<double>(::sysconf(_SC_CLK_TCK)),
          std::stod(all.at(21)) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20)};
}

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto place = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(place));
  return values[place];
}

/// What one subscriber gets of a topic whose messages begin with a stamp, at a rate that is expected.
class Receiver {
 public:
  Receiver(int domain, const std::string& topic, const std::string& type, int rate_hz)
      : topic_(topic),
        rate_hz_(rate_hz),
        peer_(domain),
        reader_(peer_.subscribe(topic, type, /*late=*/false)),
        thread_([this](const std::stop_token& end) { receive(end); }) {}

  void begin() { counts_ = true; }
  /// Ends and prints what came, as a row of a table.
  void report() {
    thread_.request_stop();
    thread_.join();
    const std::int64_t span_ns = newest_ns_ - first_ns_;
    const auto expected =
        static_cast<std::int64_t>(std::llround(static_cast<double>(span_ns) * 1e-9 * rate_hz_)) + 1;
    fmt::print(
        "  {}: received {} of {}; from their stamp to the subscriber: p50 {:.2f} ms, p99 {:.2f} ms, "
        "p99.9 {:.2f} ms, longest {:.1f} ms\n",
        topic_, late_ms_.size(), expected, quantile(late_ms_, 0.5), quantile(late_ms_, 0.99),
        quantile(late_ms_, 0.999), late_ms_.empty() ? 0 : *std::ranges::max_element(late_ms_));
  }

 private:
  void receive(const std::stop_token& end) {
    while (!end.stop_requested()) {
      reader_->wait_for_unread_message({0, 100'000'000});
      for (const std::string& message : FastPeer::take(reader_)) {
        const std::int64_t now_ns = rt::realtimeNow_ns();
        CdrBytes bytes(message);
        const std::int64_t seconds = bytes.number<std::int32_t>();
        const std::int64_t due_ns = seconds * rt::kNsPerSecond + bytes.number<std::uint32_t>();
        if (!counts_) continue;
        if (late_ms_.empty()) first_ns_ = due_ns;
        newest_ns_ = due_ns;
        late_ms_.push_back(static_cast<double>(now_ns - due_ns) * 1e-6);
      }
    }
  }

  std::string topic_;
  int rate_hz_;
  FastPeer peer_;
  dds::DataReader* reader_;
  std::atomic<bool> counts_{false};
  std::vector<double> late_ms_;
  std::int64_t first_ns_ = 0;
  std::int64_t newest_ns_ = 0;
  std::jthread thread_;  // last: it uses all of them
};

void printLoop(const char* when, Daemon& daemon) {
  const nlohmann::json loop = daemon.status().at("loop");
  const auto us = [&](const char* what, const char* quantile) {
    return loop.at(what).at(quantile).get<double>() * 1e-3;
  };
  fmt::print(
      "{}: ticks {}, skipped periods {}; wake-up latency p50 {:.0f} us, p99.9 {:.0f} us, longest {:.0f} us; "
      "computing p50 {:.1f} us, p99.9 {:.1f} us\n",
      when, loop.at("counters").at("ticks").get<std::uint64_t>(),
      loop.at("counters").at("skippedPeriods").get<std::uint64_t>(), us("wakeupLatency", "p50Ns"),
      us("wakeupLatency", "p999Ns"), us("wakeupLatency", "maxNs"), us("computeTime", "p50Ns"),
      us("computeTime", "p999Ns"));
}

/// Longest measurement without hapticd-ros, which only shows what is usual on the machine.
constexpr int kLongestWithout_s = 60;

int run(const Options& options) {
  const std::string yaml = std::string(kWallYaml) + "control: {engage_at_start: true}\n";
  {
    const DaemonHome home;
    Daemon daemon(home, yaml);
    if (!daemon.answers()) return 1;
    std::this_thread::sleep_for(std::chrono::seconds(std::min(options.seconds, kLongestWithout_s)));
    printLoop("without hapticd-ros", daemon);
  }
  const int domain = ownDomain();
  const std::string name_space = ownNamespace();
  const DaemonHome home;
  Daemon daemon(home, yaml);
  if (!daemon.answers()) return 1;
  Program bridge({HAPTICD_ROS_PROGRAM, "--socket", home.statusSocket(), "--domain", std::to_string(domain),
                  "--namespace", name_space, "--rate", std::to_string(options.rate_hz)});
  std::vector<std::unique_ptr<Receiver>> receivers;
  for (int i = 0; i < options.subscribers; ++i)
    receivers.push_back(std::make_unique<Receiver>(domain, "rt/" + name_space + "/setpoint_cf",
                                                   "geometry_msgs::msg::dds_::WrenchStamped_",
                                                   options.rate_hz));
  if (options.clouds)
    receivers.push_back(std::make_unique<Receiver>(domain, "rt/" + name_space + "/scene/points",
                                                   "sensor_msgs::msg::dds_::PointCloud2_", 10));
  std::this_thread::sleep_for(std::chrono::seconds(3));  // until all have found each other
  for (const auto& receiver : receivers) receiver->begin();
  const Usage before = usageOf(bridge.pid());
  std::this_thread::sleep_for(std::chrono::seconds(options.seconds));
  const Usage after = usageOf(bridge.pid());
  printLoop("with hapticd-ros", daemon);
  fmt::print(
      "hapticd-ros: {} Hz, {} subscribers, {} s: {:.1f} % of a core, {:.1f} MiB at the beginning, "
      "{:.1f} MiB at the end\n",
      options.rate_hz, options.subscribers, options.seconds,
      100 * (after.cpu_s - before.cpu_s) / options.seconds, before.resident_mib, after.resident_mib);
  for (const auto& receiver : receivers) receiver->report();
  return 0;
}

}  // namespace
}  // namespace hapticd::test

int main(int argc, char** argv) {
  hapticd::test::Options options;
  CLI::App app{
      "Measures hapticd-ros with subscribers of Fast DDS: what arrives, how late, and what it costs."};
  app.add_option("--seconds", options.seconds, "with hapticd-ros; without, a minute at most (60)");
  app.add_option("--rate", options.rate_hz, "of hapticd-ros, Hz (1000)");
  app.add_option("--subscribers", options.subscribers, "of forces (1)");
  app.add_flag("--clouds", options.clouds, "with a subscriber of clouds at 10 Hz, too");
  CLI11_PARSE(app, argc, argv);
  return hapticd::test::run(options);
}
