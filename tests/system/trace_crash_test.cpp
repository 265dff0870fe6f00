// hapticd killed while it writes a trace, and what the next start makes of it.

#include <gtest/gtest.h>
#include <signal.h>

#include <random>
#include <thread>

#include "drivers/monotonic_clock.h"
#include "drivers/trace/trace_folder.h"
#include "drivers/trace/trace_reader.h"
#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;

/// What a readable trace holds.
struct Content {
  std::uint64_t ticks = 0;
  std::uint64_t missing = 0;  ///< between the first and the last one
  std::int64_t last_ns = 0;   ///< CLOCK_MONOTONIC of the last one
  bool complete = false;
};

Content contentOf(const fs::path& trace) {
  Content content;
  std::uint64_t last = 0;
  drivers::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick& tick) {
    if (last != 0) content.missing += tick.number - last - 1;
    last = tick.number;
    ++content.ticks;
    content.last_ns = tick.planned_ns;
    return true;
  };
  const auto info = drivers::readTrace(trace, visitor);
  EXPECT_TRUE(info.has_value()) << info.error().text();
  content.complete = info && info->complete;
  return content;
}

/// A trace, and when its writer was killed (CLOCK_MONOTONIC).
struct Killed {
  std::string name;
  std::int64_t time_ns = 0;
};

/// Lets hapticd write for a while and kills it.
Killed killWhileTracing(const DaemonHome& home, std::chrono::milliseconds life) {
  Daemon daemon(home, test::kWallYaml, {"trace.at_start=true", "trace.min_free_mb=0"});
  EXPECT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const json& status) { return status.at("trace").at("ticks") > 0; }));
  Killed killed{daemon.status().at("trace").at("name"), 0};
  std::this_thread::sleep_for(life);  // the moment is the test's input, nothing is waited for
  killed.time_ns = drivers::monotonicNs();
  daemon.signal(SIGKILL);
  daemon.wait();
  return killed;
}

/// A part of the hundred, so that they run side by side.
class TraceCrash : public testing::TestWithParam<unsigned> {};

TEST_P(TraceCrash, LosesAtMostTheOpenChunk) {
  constexpr int kKills = 25;
  constexpr std::int64_t kMostLost_ns = 4'000'000'000;  // a chunk of a second, and what a busy disk adds
  std::mt19937 random(GetParam());
  std::uniform_int_distribution<int> life_ms(0, 2000);
  const DaemonHome home;
  std::vector<Killed> killed;
  for (int i = 0; i < kKills; ++i) {
    killed.push_back(killWhileTracing(home, std::chrono::milliseconds(life_ms(random))));
  }
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches([](const json& status) { return status.at("trace").at("recovered") > 0; }));
  ASSERT_TRUE(test::becomesTrue([&] {
    const auto entries = drivers::listTraces(home.traceFolder());
    return entries && std::ranges::none_of(*entries, &drivers::TraceEntry::open);
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));

  std::int64_t longest_loss_ns = 0;
  int empty = 0;
  for (const Killed& kill : killed) {
    const fs::path trace = home.traceFolder() / (kill.name + ".mcap");
    if (!fs::exists(trace)) {  // no chunk was whole yet
      ++empty;
      continue;
    }
    const Content content = contentOf(trace);
    EXPECT_TRUE(content.complete) << kill.name;
    EXPECT_EQ(content.missing, 0U) << kill.name;
    if (content.ticks > 0) longest_loss_ns = std::max(longest_loss_ns, kill.time_ns - content.last_ns);
  }
  EXPECT_LT(longest_loss_ns, kMostLost_ns);
  EXPECT_LT(empty, kKills);
  RecordProperty("longest_loss_ms", static_cast<int>(longest_loss_ns / 1'000'000));
  std::printf("longest loss %.3f s, %d of %d without a whole chunk\n",
              static_cast<double>(longest_loss_ns) * 1e-9, empty, kKills);
}

INSTANTIATE_TEST_SUITE_P(RandomMoments, TraceCrash, testing::Values(1U, 2U, 3U, 4U));

}  // namespace
}  // namespace hapticd
