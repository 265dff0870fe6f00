// Faults made up in the real daemon, one after the other without a restart, judged at the far end of a real
// wire: by what haptic-bridge was told to exert and exerted.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>

#include "tests/system/bridge_log.h"
#include "tests/system/daemon_under_test.h"

namespace hapticd::test {
namespace {

constexpr double kMaxForce_n = 2.5;
constexpr double kMaxSlew_n_per_s = 100;
constexpr double kHandleTimeout_s = 0.02;
constexpr double kDepthTimeout_s = 0.3;
constexpr double kDepthRamp_s = 0.2;
/// Between the force loop and the device: a command is sent each 5 ms at least, exerted at the device's next
/// tick; and either end may come late on a machine that others use, as the bridge's own promise of 50 ms
/// allows for.
constexpr double kWire_s = 0.05;
/// A force is felt again.
constexpr double kFelt_n = 0.3;

struct Case {
  const char* fault;
  double duration_s;
  const char* cause;                   ///< of the mode that it leads to; empty: the box stays engaged
  std::optional<double> zero_after_s;  ///< since the fault began; nothing: the force goes on
  bool engage_again = false;
};

/// In the order of the script. What is stated here stands in rt/README.md too.
const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"lost_frames", 0.6, "", std::nullopt},
      {"frozen_camera", 0.9, "depth_stale", kDepthTimeout_s + kDepthRamp_s},
      {"garbage_depth", 0.5, "", std::nullopt},
      {"handle_muted", 0.4, "handle_stale", kHandleTimeout_s + 0.003},
      {"nan_pose", 0.4, "handle_invalid", 0.003},
      {"handle_leap", 0.4, "handle_too_fast", 0.003},
      {"late_ticks", 0.8, "overrun_burst", 0.064 + kDepthRamp_s},
      {"channel_overflow", 16.9, "", std::nullopt},
      {"handle_unplugged", 0.4, "handle_stale", kHandleTimeout_s + 0.003, true},
  };
  return all;
}

constexpr double kFirst_s = 2.5;
constexpr double kPause_s = 2.2;  // the longest recovery takes a second, and half a one of ramp

double beginOf(std::size_t number) {
  double begin = kFirst_s;
  for (std::size_t i = 0; i < number; ++i) begin += cases()[i].duration_s + kPause_s;
  return begin;
}

std::string script() {
  std::string text;
  for (std::size_t i = 0; i < cases().size(); ++i) {
    text += fmt::format("{:.3f} {:.3f} {}\n", beginOf(i), cases()[i].duration_s, cases()[i].fault);
  }
  return text;
}

double now_s() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What was seen at the device of one fault.
struct Seen {
  double largest_n = 0;
  double largest_step_n = 0;  ///< from one row to the next
  std::optional<double> zero_after_s;
  bool felt_before = false;
  bool felt_after = false;
};

class FaultTable : public testing::Test {
 protected:
  /// With so short a ramp each force that comes back comes at the slew limit.
  std::string yaml() const {
    return fmt::format(
        "camera: {{driver: synthetic}}\nsynthetic: {{scene: plane, noise: off, distance_m: 1}}\n"
        "force: {{law: nearest_springs}}\nhandle: {{driver: udp}}\n"
        "udp_handle: {{address: {}, peer: '{}:47801'}}\n"
        "safety: {{engage_inside: true, engage_ramp_s: 0.01, max_force_n: {}, max_slew_n_per_s: {}, "
        "handle_timeout_s: {}, "
        "depth_timeout_s: {}, depth_ramp_s: {}}}\n"
        "control: {{engage_at_start: true, allow_fault_injection: true}}\n",
        ownLoopback(1), ownLoopback(2), kMaxForce_n, kMaxSlew_n_per_s, kHandleTimeout_s, kDepthTimeout_s,
        kDepthRamp_s);
  }

  /// The rows of fault `number` and of the time until the next one.
  Seen look(std::size_t number, double start_s) const {
    const double begin_s = start_s + beginOf(number);
    const double end_s = begin_s + cases()[number].duration_s;
    Seen seen;
    const BridgeRow* before = nullptr;
    for (const BridgeRow& row : rows_) {
      const double time_s = static_cast<double>(row.time_ns) * 1e-9;
      const double force_n = length(row.exerted_n);
      if (time_s > begin_s - 0.3 && time_s < begin_s) seen.felt_before |= force_n > kFelt_n;
      if (time_s >= begin_s && time_s < end_s + kPause_s) {
        seen.largest_n = std::max(seen.largest_n, force_n);
        if (before) {
          seen.largest_step_n =
              std::max(seen.largest_step_n, distanceBetween(row.exerted_n, before->exerted_n));
        }
        if (time_s < end_s && !seen.zero_after_s && force_n == 0) seen.zero_after_s = time_s - begin_s;
        if (time_s > end_s) seen.felt_after |= force_n > kFelt_n;
      }
      before = &row;
    }
    return seen;
  }

  /// No step above the slew limit, for the time and the ticks of the force loop that may lie between two
  /// rows: those of the time between, one at each end, and what a command waited on its way. A thread that is
  /// interrupted between reading its clock and handing on a force dates it too early, the daemon's the
  /// command and the bridge's the row, so the longer of the two times counts. Steps that end in zero at once
  /// are releases, which take three ticks.
  void expectSlewLimited() const {
    constexpr std::size_t kRelease_rows = 10;  // three ticks of the force loop, and late rows
    constexpr std::size_t kSpan_rows = 12;     // the whole clamp at the limit: what the ends add counts less
    std::size_t zero_ahead = rows_.size();     // the next row without a force
    for (std::size_t end = rows_.size(); end-- > 1;) {
      const BridgeRow& row = rows_[end];
      if (length(row.exerted_n) == 0) zero_ahead = end;
      const bool releases = zero_ahead < end + kRelease_rows;
      for (std::size_t begin = end - std::min(end, kSpan_rows); begin < end; ++begin) {
        const BridgeRow& before = rows_[begin];
        const double step_n = distanceBetween(row.exerted_n, before.exerted_n);
        const std::int64_t at_device_ns = row.time_ns - before.time_ns + std::max(row.age_ns, before.age_ns);
        const double between_s =
            1e-9 * static_cast<double>(std::max(at_device_ns, row.made_ns - before.made_ns));
        const bool down = length(row.exerted_n) < length(before.exerted_n);
        ASSERT_TRUE(step_n <= kMaxSlew_n_per_s * (between_s + 0.003) + 1e-5 || (down && releases))
            << step_n << " N within " << between_s << " s, " << end - begin << " rows";
      }
    }
  }

  void writeTable(const std::vector<Seen>& all) const {
    std::ofstream table(HAPTICD_FAULT_TABLE);
    table << "| fault | mode it leads to | stated: zero within | zero at the device after | largest force | "
             "felt again |\n|---|---|---|---|---|---|\n";
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Case& stated = cases()[i];
      const auto milliseconds = [](const std::optional<double>& time_s) {
        return time_s ? fmt::format("{:.0f} ms", *time_s * 1000) : std::string("(goes on)");
      };
      table << fmt::format("| {} | {} | {} | {} | {:.2f} N | {} |\n", stated.fault,
                           *stated.cause == '\0' ? "engaged" : fmt::format("holding: {}", stated.cause),
                           milliseconds(stated.zero_after_s),
                           stated.zero_after_s ? milliseconds(all[i].zero_after_s) : "(goes on)",
                           all[i].largest_n, stated.engage_again ? "on request" : "by itself");
    }
  }

  TemporaryFolder folder_;
  DaemonHome home_;
  std::vector<BridgeRow> rows_;
};

TEST_F(FaultTable, HoldsAtTheDeviceForEveryFaultThatCanBeMadeUp) {
  const std::string log = folder_.path() / "log.csv";
  const std::string faults = folder_.write("faults", script());
  std::vector<std::string> command = home_.command(yaml());
  command.insert(command.end(), {"--inject", faults});
  Program bridge({HAPTIC_BRIDGE_PROGRAM, "--peer", ownLoopback(1) + ":47800", "--local",
                  ownLoopback(2) + ":47801", "--start", "0,0,-0.97", "--travel", "0.02", "--press-force", "2",
                  "--log", log});
  Daemon daemon(home_, command);
  ASSERT_TRUE(daemon.answers());
  const double asked_s = now_s();
  // not later than it was, so that what is measured since then is too long by the time of an answer at most
  const double start_s = asked_s - daemon.status().at("uptimeS").get<double>();
  ASSERT_TRUE(daemon.reaches([&](const nlohmann::json& status) {
    return status.at("cause") == "handle_replaced" && status.at("uptimeS") > beginOf(cases().size() - 1);
  })) << "what is unplugged comes back as another session, which nobody has engaged";
  ASSERT_EQ(home_.control({"engage"}).ending, exitedWith(0));
  ASSERT_TRUE(daemon.reaches(
      [&](const nlohmann::json& status) { return status.at("uptimeS") > beginOf(cases().size()); }));
  const nlohmann::json status = daemon.status();
  EXPECT_EQ(status.at("mode"), "engaged");
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  bridge.signal(SIGTERM);
  ASSERT_EQ(bridge.wait(), exitedWith(0));

  rows_ = bridgeRows(log);
  expectSlewLimited();
  std::vector<Seen> all;
  for (std::size_t i = 0; i < cases().size(); ++i) {
    const Case& stated = cases()[i];
    SCOPED_TRACE(stated.fault);
    all.push_back(look(i, start_s));
    const Seen& seen = all.back();
    EXPECT_TRUE(seen.felt_before);
    EXPECT_TRUE(seen.felt_after) << "without a restart";
    EXPECT_LE(seen.largest_n, kMaxForce_n + 1e-5) << "six digits of the log";
    if (stated.zero_after_s) {
      ASSERT_TRUE(seen.zero_after_s) << "the force never was zero";
      EXPECT_LE(*seen.zero_after_s, *stated.zero_after_s + kWire_s);
    }
    if (*stated.cause != '\0') {
      EXPECT_GT(status.at("loop").at("transitions").at("byCause").at(stated.cause), 0);
    }
  }
  EXPECT_GT(status.at("loop").at("traceTicksDropped"), 0) << "channel_overflow";
  writeTable(all);
}

}  // namespace
}  // namespace hapticd::test
