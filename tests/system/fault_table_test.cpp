// SPDX-License-Identifier: Apache-2.0
// Faults injected into the real daemon, one after the other without a restart, judged at the device's end of
// a real connection by what haptic-bridge was commanded to exert. Every command names the tick of the force
// loop that computed it and when that tick began, so that a late packet or a late row of the log is not taken
// for a late force: what others do on this machine does not count. Only some of the daemon's ticks arrive;
// what is claimed of them holds of any choice.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/system/support/bridge_log.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

constexpr double kMaxForce_n = 2.5;
constexpr double kMaxSlew_n_per_s = 100;
constexpr double kPeriod_s = 0.001;
/// Below the 100 ms after which the driver takes the device for lost.
constexpr double kHandleTimeout_s = 0.08;
constexpr double kDepthTimeout_s = 0.3;
constexpr double kDepthRamp_s = 0.2;
/// A force acts.
constexpr double kActs_n = 0.3;
/// Guaranteed by the bridge: after that time without a command it exerts nothing.
constexpr std::int64_t kDeadMan_ns = 20'000'000;
/// The daemon's start is known from the newest tick of a status, which is that old at most.
constexpr std::int64_t kStartKnown_ns = 2'000'000;
/// Rounding of the log to six digits.
constexpr double kRounding_n = 2e-5;

/// A release takes three ticks, the first of them the one that sees the fault.
constexpr std::uint64_t kReleaseTicks = 2;
/// What fades by the clock follows at the slew limit, tick by tick, where ticks are left out.
constexpr auto kFadeTicks = static_cast<std::uint64_t>(kMaxForce_n / (kMaxSlew_n_per_s * kPeriod_s)) + 1;

struct Case {
  const char* fault;
  double duration_s;
  const char* cause;  ///< of the mode that it leads to; empty: the box stays engaged
  /// The last tick that takes what it has for good begins that long after the fault; nothing: no bound.
  std::optional<double> seen_within_s;
  double zero_within_s = 0;             ///< since the tick that saw it
  std::uint64_t zero_within_ticks = 0;  ///< the same, by the number of the tick; the later one counts
  const char* stated;                   ///< the same for people, as docs/faults.md has it
  bool engage_again = false;
};

/// The faults in the order of the script. A handle that sends nothing during its fault becomes stale.
const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"lost_frames", 0.6, "", {}, 0, 0, "goes on"},
      {"frozen_camera", 0.9, "depth_stale", kDepthTimeout_s, kDepthRamp_s, kFadeTicks,
       "0.3 s, then 0.2 s of fading"},
      {"garbage_depth", 0.5, "", {}, 0, 0, "goes on"},
      {"handle_muted", 0.4, "handle_stale", kHandleTimeout_s, 0, kReleaseTicks, "80 ms and 3 ticks"},
      {"nan_pose", 0.4, "handle_invalid", kHandleTimeout_s, 0, kReleaseTicks, "3 ticks from its measurement"},
      {"handle_leap", 0.4, "handle_too_fast", kHandleTimeout_s, 0, kReleaseTicks,
       "3 ticks from its measurement"},
      {"late_ticks",
       0.8,
       "overrun_burst",
       {},
       kDepthRamp_s,
       kFadeTicks,
       "20 late of 64 ticks, then 0.2 s of fading"},
      {"handle_unplugged", 0.4, "handle_stale", kHandleTimeout_s, 0, kReleaseTicks, "80 ms and 3 ticks",
       true},
  };
  return all;
}

constexpr double kFirst_s = 2.5;
constexpr double kPause_s = 2.2;  // the longest recovery takes a second, and half a one of ramp
/// Where something else keeps the force away while a fault is on, the fault is judged in a later round.
constexpr std::size_t kRounds = 8;

double duration_s(std::size_t cases_before) {
  double sum_s = 0;
  for (std::size_t i = 0; i < cases_before; ++i) sum_s += cases()[i].duration_s + kPause_s;
  return sum_s;
}

/// Since the daemon's start.
double beginOf(std::size_t round, std::size_t number) {
  return kFirst_s + static_cast<double>(round) * duration_s(cases().size()) + duration_s(number);
}

std::string script() {
  std::string text;
  for (std::size_t round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < cases().size(); ++i) {
      text += fmt::format("{:.3f} {:.3f} {}\n", beginOf(round, i), cases()[i].duration_s, cases()[i].fault);
    }
  }
  return text;
}

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

/// A tick of the force loop, as it arrived.
struct Command {
  std::uint64_t tick = 0;
  std::int64_t time_ns = 0;
  rt::Vec3 force_n;
};

/// Returns the commands of the force loop in their order. Where the driver vetoes a command (mode zero)
/// nothing is known of the loop's.
std::vector<Command> commandsIn(const std::vector<BridgeRow>& rows) {
  std::vector<Command> commands;
  for (const BridgeRow& row : rows) {
    if (!row.active || (!commands.empty() && row.force_tick <= commands.back().tick)) continue;
    commands.push_back({row.force_tick, row.force_tick_ns, row.commanded_n});
  }
  return commands;
}

/// The device exerts what it was commanded to, or less: for each row the bridge has looked at its clock
/// once.
void expectExertedAsCommanded(const std::vector<BridgeRow>& rows) {
  for (const BridgeRow& row : rows) {
    ASSERT_LE(norm(row.commanded_n), kMaxForce_n + kRounding_n) << "tick " << row.force_tick;
    ASSERT_LE(norm(row.exerted_n), norm(row.commanded_n) + kRounding_n) << "tick " << row.force_tick;
    const bool may_exert = row.active && row.age_ns < kDeadMan_ns;
    ASSERT_TRUE(may_exert || norm(row.exerted_n) == 0) << "at " << row.time_ns;
  }
}

struct Seen {
  double largest_n = 0;
  std::optional<double> last_force_s;  ///< since the fault began, by the daemon's clock
};

class FaultTable : public testing::Test {
 protected:
  /// The ramp is so short that each force returns at the slew limit.
  std::string yaml() const {
    return fmt::format(
        "camera: {{driver: synthetic}}\nsynthetic: {{scene: plane, noise: off, distance_m: 1}}\n"
        "force: {{law: nearest_springs}}\nhandle: {{driver: udp}}\n"
        "udp_handle: {{address: {}, peer: '{}:47801'}}\n"
        "safety: {{engage_inside: true, engage_ramp_s: 0.01, max_force_n: {}, max_slew_n_per_s: {}, "
        "handle_timeout_s: {}, overrun_burst: 20, depth_timeout_s: {}, depth_ramp_s: {}}}\n"
        "control: {{engage_at_start: true, allow_fault_injection: true}}\n",
        ownLoopback(1), ownLoopback(2), kMaxForce_n, kMaxSlew_n_per_s, kHandleTimeout_s, kDepthTimeout_s,
        kDepthRamp_s);
  }

  std::vector<std::string> daemonCommand(const std::string& faults) const {
    std::vector<std::string> command = home_.command(yaml());
    command.insert(command.end(), {"--inject", folder_.write("faults", faults)});
    return command;
  }

  std::vector<std::string> bridgeCommand() const {
    // without damping of its own the device exerts what it is commanded to
    return {HAPTIC_BRIDGE_PROGRAM, "--no-damping", "--peer", ownLoopback(1) + ":47800", "--local",
            ownLoopback(2) + ":47801",
            // springs begin again only when the hand has left them, so it strokes and retreats in turn
            "--start", "0,0,-0.94", "--travel", "0.05", "--speed", "0.3", "--press-force", "2", "--log",
            log()};
  }

  std::string log() const { return folder_.path() / "log.csv"; }

  /// Keeps what a status reports of transitions and of the daemon's start.
  void learnFrom(const nlohmann::json& status) {
    for (const nlohmann::json& transition : status.at("loop").at("transitions").at("newest")) {
      transitions_[transition.at("timeNs")] = transition.at("cause");
    }
    const std::int64_t tick_ns = status.at("tick").at("plannedNs");
    start_ns_ = std::max(start_ns_, tick_ns - nanoseconds(status.at("uptimeS").get<double>()));
  }

  /// Whatever is lost and comes back is another session, which somebody has to engage.
  void engageIfReplaced(const nlohmann::json& status) {
    if (status.at("cause") == "handle_replaced") home_.control({"engage"});
  }

  /// Waits until `uptime_s`, and until the log has reached that time.
  void liveThrough(Daemon& daemon, double uptime_s) {
    while (true) {
      const nlohmann::json status = daemon.status();
      ASSERT_FALSE(status.is_null());
      learnFrom(status);
      engageIfReplaced(status);
      if (status.at("uptimeS") > uptime_s) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  /// Returns the commands of [from_ns, to_ns).
  std::vector<Command> commandsBetween(std::int64_t from_ns, std::int64_t to_ns) const {
    std::vector<Command> some;
    std::ranges::copy_if(commands_, std::back_inserter(some), [&](const Command& command) {
      return command.time_ns >= from_ns && command.time_ns < to_ns;
    });
    return some;
  }

  bool actsBetween(std::int64_t from_ns, std::int64_t to_ns) const {
    return std::ranges::any_of(commandsBetween(from_ns, to_ns),
                               [](const Command& command) { return norm(command.force_n) > kActs_n; });
  }

  /// Returns when the fault was seen; nothing if another cause preceded it.
  std::optional<std::int64_t> seenAt(const Case& stated, std::int64_t begin_ns, std::int64_t end_ns) const {
    const auto first = transitions_.lower_bound(begin_ns);
    if (first == transitions_.end() || first->first >= end_ns || first->second != stated.cause) return {};
    return first->first;
  }

  /// Whether the box saw a fault of the handle in (from_ns, to_ns].
  bool handleFailedBetween(std::int64_t from_ns, std::int64_t to_ns) const {
    return std::any_of(transitions_.upper_bound(from_ns), transitions_.upper_bound(to_ns),
                       [](const auto& transition) { return transition.second.starts_with("handle_"); });
  }

  /// No step above the slew limit for the ticks that lie between, but down for a release: it comes to zero
  /// two ticks later, or, where these did not arrive, its cause is known and the force may be on its way
  /// back.
  void expectSlewLimited() const {
    constexpr std::size_t kBefore = kReleaseTicks + 1;  // commands, and so at least as many ticks
    for (std::size_t i = 1; i < commands_.size(); ++i) {
      const Command& before = commands_[i - 1];
      const Command& now = commands_[i];
      const double step_n = norm(now.force_n - before.force_n);
      const auto ticks = static_cast<double>(now.tick - before.tick);
      if (step_n <= kMaxSlew_n_per_s * kPeriod_s * ticks + kRounding_n) continue;
      const auto later =
          std::find_if(commands_.begin() + static_cast<std::ptrdiff_t>(i), commands_.end(),
                       [&](const Command& command) { return command.tick >= now.tick + kReleaseTicks; });
      const bool releases = later == commands_.end() || norm(later->force_n) == 0 ||
                            handleFailedBetween(commands_[i - std::min(i, kBefore)].time_ns, now.time_ns);
      ASSERT_TRUE(releases && norm(now.force_n) < norm(before.force_n))
          << step_n << " N from tick " << before.tick << " to " << now.tick;
    }
  }

  /// Returns the observations of a fault in that round; nothing if the force was away for another reason, or
  /// has not come back, before or after it. The bounds hold wherever the fault was seen.
  std::optional<Seen> judge(std::size_t round, std::size_t number) const {
    const Case& stated = cases()[number];
    const std::int64_t begin_ns = start_ns_ + nanoseconds(beginOf(round, number));
    const std::int64_t end_ns = begin_ns + nanoseconds(stated.duration_s);
    const std::int64_t next_ns = end_ns + nanoseconds(kPause_s);
    if (commands_.empty() || commands_.back().time_ns < next_ns - nanoseconds(kPause_s / 4)) return {};
    Seen seen;
    for (const Command& command : commandsBetween(begin_ns, next_ns)) {
      seen.largest_n = std::max(seen.largest_n, norm(command.force_n));
    }
    if (*stated.cause != '\0') {
      const auto seen_ns = seenAt(stated, begin_ns, end_ns);
      if (!seen_ns) return {};
      seen.last_force_s = expectZero(stated, begin_ns, *seen_ns, end_ns);
    } else if (!actsBetween(begin_ns, end_ns)) {
      return {};
    }
    const bool acts = actsBetween(begin_ns - nanoseconds(0.3), begin_ns) && actsBetween(end_ns, next_ns);
    return acts ? std::optional(seen) : std::nullopt;
  }

  /// The last force until the box recovers, s since the fault began; it is within the bounds.
  double expectZero(const Case& stated, std::int64_t begin_ns, std::int64_t seen_ns,
                    std::int64_t end_ns) const {
    const auto next = transitions_.upper_bound(seen_ns);
    if (next != transitions_.end()) end_ns = std::min(end_ns, next->first);
    const std::int64_t zero_ns = seen_ns + nanoseconds(stated.zero_within_s);
    double last_force_s = 0;
    std::optional<std::uint64_t> first_tick;  // that arrived, from zero_ns on
    for (const Command& command : commandsBetween(begin_ns, end_ns)) {
      if (command.time_ns >= zero_ns && !first_tick) first_tick = command.tick;
      if (norm(command.force_n) == 0) continue;
      last_force_s = 1e-9 * static_cast<double>(command.time_ns - begin_ns);
      if (command.time_ns < seen_ns && stated.seen_within_s) {
        EXPECT_LE(last_force_s, *stated.seen_within_s + 1e-9 * kStartKnown_ns) << "tick " << command.tick;
      }
      if (first_tick) {
        EXPECT_LT(command.tick, *first_tick + stated.zero_within_ticks) << norm(command.force_n) << " N";
      }
    }
    return last_force_s;
  }

  TemporaryFolder folder_;
  DaemonHome home_;
  std::vector<Command> commands_;
  std::map<std::int64_t, std::string> transitions_;  // by time
  std::int64_t start_ns_ = 0;
};

std::string leadsTo(const Case& stated) {
  return *stated.cause == '\0' ? "engaged" : fmt::format("holding: {}", stated.cause);
}

const char* returns(const Case& stated) {
  return stated.engage_again ? "on request" : "by itself";
}

/// Writes the table that tools/figures inserts into docs/faults.md.
void writeTable(const std::vector<Seen>& all) {
  std::ofstream table(HAPTICD_FAULT_TABLE);
  table << "| fault | mode it leads to | stated: zero within | last force | largest force | force returns |\n"
           "|---|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Case& stated = cases()[i];
    table << fmt::format(
        "| {} | {} | {} | {} | {:.2f} N | {} |\n", stated.fault, leadsTo(stated), stated.stated,
        all[i].last_force_s ? fmt::format("{:.0f} ms", *all[i].last_force_s * 1000) : std::string("goes on"),
        all[i].largest_n, returns(stated));
  }
}

/// The cells of each row of the table between the marks of docs/faults.md, without its two head lines.
std::vector<std::vector<std::string>> documentedRows() {
  std::ifstream document(HAPTICD_FAULT_DOCUMENT);
  std::vector<std::vector<std::string>> rows;
  bool inside = false;
  for (std::string line; std::getline(document, line);) {
    if (line == "<!-- faults: end -->") break;
    if (inside) {
      std::vector<std::string>& cells = rows.emplace_back();
      for (std::size_t begin = 2, end = 0; (end = line.find(" |", begin)) != std::string::npos;
           begin = end + 3) {
        cells.push_back(line.substr(begin, end - begin));
      }
    }
    inside = inside || line == "<!-- faults: begin -->";
  }
  rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, rows.size())));
  return rows;
}

TEST(FaultDocument, StatesWhatTheTableIsTestedFor) {
  const auto rows = documentedRows();
  ASSERT_EQ(rows.size(), cases().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Case& stated = cases()[i];
    ASSERT_EQ(rows[i].size(), 6U) << stated.fault;
    EXPECT_EQ(rows[i][0], stated.fault);
    EXPECT_EQ(rows[i][1], leadsTo(stated)) << stated.fault;
    EXPECT_EQ(rows[i][2], stated.stated) << stated.fault;
    EXPECT_EQ(rows[i][5], returns(stated)) << stated.fault;
  }
}

TEST_F(FaultTable, HoldsAtTheDeviceForEveryFaultThatCanBeMadeUp) {
  Program bridge(bridgeCommand());
  Daemon daemon(home_, daemonCommand(script()));
  ASSERT_TRUE(daemon.answers());
  std::vector<std::optional<Seen>> all(cases().size());
  for (std::size_t round = 0; round < kRounds && !std::ranges::all_of(all, &std::optional<Seen>::has_value);
       ++round) {
    ASSERT_NO_FATAL_FAILURE(liveThrough(daemon, beginOf(round + 1, 0)));
    const std::vector<BridgeRow> rows = bridgeRows(log());
    expectExertedAsCommanded(rows);
    commands_ = commandsIn(rows);
    expectSlewLimited();
    for (std::size_t i = 0; i < cases().size(); ++i) {
      SCOPED_TRACE(fmt::format("{} in round {}", cases()[i].fault, round + 1));
      if (const auto seen = judge(round, i); seen && !all[i]) all[i] = seen;
    }
  }
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  std::vector<Seen> table;
  for (std::size_t i = 0; i < cases().size(); ++i) {
    ASSERT_TRUE(all[i]) << cases()[i].fault << ": in no round was it seen with a force before and after it";
    table.push_back(*all[i]);
  }
  writeTable(table);
}

TEST_F(FaultTable, TheForceGoesOnWhileNobodyTakesTheTicks) {
  Program bridge(bridgeCommand());
  Daemon daemon(home_, daemonCommand("1 86400 channel_overflow\n"));
  ASSERT_TRUE(daemon.answers());
  // the ring holds 16 s of ticks, and of more where the loop leaves ticks out
  bool overflowed = false;
  for (int patience = 0; patience < 4 && !overflowed; ++patience) {
    overflowed = becomesTrue([&] {
      const nlohmann::json status = daemon.status();
      learnFrom(status);
      return status.at("loop").at("traceTicksDropped") > 0;
    });
  }
  ASSERT_TRUE(overflowed);
  std::uint64_t tick = 0;
  ASSERT_TRUE(daemon.reaches([&](const nlohmann::json& status) {
    learnFrom(status);
    engageIfReplaced(status);
    tick = status.at("tick").at("number");
    return status.at("mode") == "engaged";
  }));
  EXPECT_TRUE(becomesTrue([&] {
    const nlohmann::json status = daemon.status();
    learnFrom(status);
    engageIfReplaced(status);
    const std::vector<Command> commands = commandsIn(bridgeRows(log()));
    return !commands.empty() && commands.back().tick > tick && norm(commands.back().force_n) > kActs_n;
  })) << "a force acts";
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  const std::vector<BridgeRow> rows = bridgeRows(log());
  expectExertedAsCommanded(rows);
  commands_ = commandsIn(rows);
  expectSlewLimited();
}

}  // namespace
}  // namespace hapticd::test
