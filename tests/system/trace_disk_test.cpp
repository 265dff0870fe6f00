// SPDX-License-Identifier: Apache-2.0
// Traces on a full disk, in a folder that cannot be written, and in one that vanishes: the force continues.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <utility>

#include "daemon/trace/reader/trace_folder.h"
#include "daemon/trace/reader/trace_reader.h"
#include "tests/support/strict_mcap.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;

bool waits(const json& status) {
  return status.at("trace").at("state") == "waiting";
}

bool writes(const json& status) {
  return status.at("trace").at("state") == "writing" && status.at("trace").at("ticks") > 0;
}

/// The hand is in contact with the wall, and no tick was noticeably late.
void expectForceGoesOn(Daemon& daemon) {
  EXPECT_TRUE(daemon.ticks());
  EXPECT_TRUE(daemon.reaches([](const json& status) {
    return status.at("mode") == "engaged" &&
           test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 0.1;
  }));
}

std::string detailOf(Daemon& daemon) {
  const json status = daemon.status();
  EXPECT_TRUE(contains(status.at("warnings").dump(), "trace waits: "));
  return status.at("trace").at("detail");
}

void expectAllReadable(const fs::path& folder) {
  const auto entries = trace::listTraces(folder);
  ASSERT_TRUE(entries) << entries.error().text();
  for (const trace::TraceEntry& entry : *entries) {
    if (entry.open) continue;
    const auto info = trace::readTrace(folder / (entry.name + ".mcap"));
    EXPECT_TRUE(info && info->complete) << entry.name << (info ? "" : ": " + info.error().text());
    EXPECT_EQ(test::readStrictly(folder / (entry.name + ".mcap")).allText(), "") << entry.name;
  }
}

struct Ticks {
  std::uint64_t count = 0;  ///< in all files
  std::uint64_t last = 0;   ///< number of the last one; the first tick of a daemon is number 1
};

std::vector<trace::TraceEntry> tracesIn(const fs::path& folder) {
  auto traces = trace::listTraces(folder);
  return traces ? std::move(*traces) : std::vector<trace::TraceEntry>();
}

/// Returns the ticks in all traces of a folder, none of which may be empty.
Ticks ticksIn(const fs::path& folder) {
  Ticks ticks;
  for (const trace::TraceEntry& entry : tracesIn(folder)) {
    trace::TraceVisitor visitor;
    visitor.tick = [&](const rt::Tick& tick) {
      ticks.last = std::max(ticks.last, tick.number);
      return true;
    };
    const auto info = trace::readTrace(folder / (entry.name + ".mcap"), visitor);
    EXPECT_TRUE(info && info->ticks > 0) << entry.name << (entry.open ? " is open" : " is empty");
    if (info) ticks.count += info->ticks;
  }
  return ticks;
}

/// Whether a trace that is being written has ticks on the disk.
bool holdsTicks(const fs::path& part) {
  bool any = false;
  trace::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick&) { return !(any = true); };
  (void)trace::readTrace(part, visitor);
  return any;
}

/// Fills the disk to its last byte.
void fillTheDisk(const fs::path& file) {
  std::ofstream stream(file, std::ios::binary);
  const std::string block(4096, 'x');
  for (int i = 0; i < 100'000 && stream; ++i) stream << block << std::flush;
  EXPECT_FALSE(stream) << "the disk is not full";
}

const std::vector<std::string> kTracing{"trace.at_start=true", "trace.min_free_mb=0",
                                        "control.engage_at_start=true"};

TEST(TraceDisk, TracesAreInTheOrderOfTheirBeginningWhateverTheirNamesSay) {
  const DaemonHome home;
  const auto record = [&home](const std::string& label) {
    Daemon daemon(home);
    ASSERT_TRUE(daemon.answers());
    ASSERT_EQ(home.control({"trace", "start", "--label", label}).ending, exitedWith(0));
    ASSERT_EQ(home.control({"trace", "stop"}).ending, exitedWith(0));
    ASSERT_EQ(daemon.terminate(), exitedWith(0));
  };
  record("first");
  const std::string ahead = "2099-01-01T00-00-00Z-first";  // as if the clock had been wrong then
  fs::rename(home.traceFolder() / (tracesIn(home.traceFolder()).at(0).name + ".mcap"),
             home.traceFolder() / (ahead + ".mcap"));
  record("second");
  record("third");
  const auto traces = tracesIn(home.traceFolder());
  ASSERT_EQ(traces.size(), 3U);
  EXPECT_EQ(traces[0].name, ahead);
  EXPECT_TRUE(traces[1].name.ends_with("-second") && traces[2].name.ends_with("-third"));
  for (std::size_t i = 0; i < traces.size(); ++i) {
    EXPECT_EQ(traces[i].number, i + 1);
    EXPECT_TRUE(traces[i].clock_is_set.has_value());
  }
}

TEST(TraceDisk, AFullDiskIsWaitedForAndLosesNoForce) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root for a small file system of its own";
  const DaemonHome home;
  fs::create_directory(home.stateFolder());
  // In a mount namespace of its own, which goes with the process.
  std::vector<std::string> command{"/usr/bin/unshare",
                                   "--mount",
                                   "/bin/sh",
                                   "-c",
                                   "mount -t tmpfs -o size=3m none \"$0\" && exec \"$@\"",
                                   home.stateFolder().string()};
  const std::vector<std::string> hapticd = home.command(test::kWallYaml, kTracing);
  command.insert(command.end(), hapticd.begin(), hapticd.end());
  Daemon daemon(home, command);
  if (!test::becomesTrue([&] { return !daemon.running() || fs::exists(home.controlSocket()); }) ||
      !daemon.running()) {
    GTEST_SKIP() << "no mount namespace here: " << daemon.errors();
  }
  ASSERT_TRUE(daemon.answers());
  const fs::path inside =
      fs::path("/proc") / std::to_string(daemon.pid()) / "root" / home.traceFolder().relative_path();
  ASSERT_TRUE(daemon.reaches(writes));
  const std::string first = daemon.status().at("trace").at("name");
  ASSERT_TRUE(test::becomesTrue([&] { return holdsTicks(inside / (first + ".mcap.part")); }));
  const fs::path filler = inside.parent_path() / "filler";
  fillTheDisk(filler);
  ASSERT_TRUE(daemon.reaches(waits));
  const std::string reason =
      detailOf(daemon);  // of the attempt, then of the space that the next one asks for
  EXPECT_TRUE(reason.find("No space left") != std::string::npos ||
              reason.find("are free") != std::string::npos)
      << reason;
  expectForceGoesOn(daemon);
  expectAllReadable(inside);

  EXPECT_TRUE(fs::exists(inside / (first + ".mcap.part"))) << "its ending does not fit either";
  fs::remove(filler);
  ASSERT_TRUE(daemon.reaches(writes));
  EXPECT_TRUE(test::becomesTrue([&] { return fs::exists(inside / (first + ".mcap")); }))
      << "finished by then";
  expectAllReadable(inside);
  EXPECT_EQ(home.control({"trace", "stop"}).ending, exitedWith(0));
  const std::uint64_t lost = daemon.status().at("trace").at("ticksLost");
  EXPECT_GT(lost, 0U);
  EXPECT_EQ(daemon.status().at("loop").at("traceTicksDropped"), 0);
  const Ticks ticks = ticksIn(inside);
  EXPECT_EQ(ticks.count + lost, ticks.last)
      << "every tick until the trace was stopped is in a file or counted";
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(TraceDisk, LittleFreeSpaceIsSaidBeforeItRunsOut) {
  const DaemonHome home;
  std::vector<std::string> set = kTracing;
  set[1] = "trace.min_free_mb=1000000";
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(waits));
  EXPECT_TRUE(contains(detailOf(daemon), "trace.min_free_mb"));
  expectForceGoesOn(daemon);
}

TEST(TraceDisk, AFolderThatMayNotBeWrittenIsWaitedFor) {
  const DaemonHome home;
  constexpr uid_t kNobody = 65534;
  const bool root = ::geteuid() == 0;
  if (root) home.giveTo(kNobody);
  fs::create_directories(home.traceFolder());
  ASSERT_EQ(::chmod(home.traceFolder().c_str(), 0555), 0);
  Daemon daemon(home, test::kWallYaml, kTracing,
                {.user = root ? std::optional<uid_t>(kNobody) : std::nullopt});
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(waits));
  EXPECT_TRUE(contains(detailOf(daemon), "ermission denied"));
  expectForceGoesOn(daemon);
  ASSERT_EQ(::chmod(home.traceFolder().c_str(), 0777), 0);
  ASSERT_TRUE(daemon.reaches(writes));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  expectAllReadable(home.traceFolder());
}

TEST(TraceDisk, AFolderThatVanishesIsMadeAgain) {
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, kTracing);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(writes));
  // at once: while it is emptied the daemon may write into it again
  fs::rename(home.traceFolder(), home.path() / "vanished");
  fs::remove_all(home.path() / "vanished");
  ASSERT_TRUE(
      daemon.reaches([&](const json& status) { return writes(status) && fs::exists(home.traceFolder()); }));
  expectForceGoesOn(daemon);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  expectAllReadable(home.traceFolder());
  EXPECT_FALSE(tracesIn(home.traceFolder()).empty());
}

TEST(TraceDisk, TheOldestTracesGoWhenTheFolderIsFullAndEachIsTold) {
  const DaemonHome home;
  fs::create_directories(home.traceFolder());
  const std::string kept = "2026-01-01T00-00-00Z-kept", dump = "2026-01-01T00-00-01Z-fault",
                    old = "2026-01-01T00-00-02Z-old";
  for (const std::string& name : {kept, dump, old}) {
    std::ofstream(home.traceFolder() / (name + ".mcap")) << "x";
    fs::resize_file(home.traceFolder() / (name + ".mcap"), 1'000'000);
  }
  std::ofstream(home.traceFolder() / (kept + ".keep")) << "";
  std::vector<std::string> set = kTracing;
  // a file ends with a whole chunk: a tenth of the folder is more than a file, so that it always warns once
  // it is full
  set.insert(set.end(), {"trace.max_file_mb=1", "trace.max_folder_mb=16", "trace.compression=none"});
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  json status;
  ASSERT_TRUE(daemon.reaches([&](const json& state) {
    status = state;
    return state.at("trace").at("deleted") > 1 && state.at("trace").at("nextDeleted") != "" &&
           contains(state.at("warnings").dump(), "is deleted next (hapticctl trace keep");
  }));
  EXPECT_EQ(status.at("trace").at("folderLimitBytes"), 16'000'000);
  EXPECT_EQ(status.at("trace").at("ticksLost"), 0);
  const std::string events = home.control({"events"}).output;
  EXPECT_TRUE(contains(events, "trace " + old + " was deleted: the traces took"));
  EXPECT_TRUE(fs::exists(home.traceFolder() / (kept + ".mcap")));
  EXPECT_TRUE(fs::exists(home.traceFolder() / (dump + ".mcap")));
  EXPECT_FALSE(fs::exists(home.traceFolder() / (old + ".mcap")));
  for (const std::string& name : {kept, dump})
    fs::remove(home.traceFolder() / (name + ".mcap"));  // no traces
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  expectAllReadable(home.traceFolder());
}

TEST(TraceDisk, ByDefaultAFinishedTraceIsNeverDeleted) {
  const DaemonHome home;
  fs::create_directories(home.traceFolder());
  const fs::path old = home.traceFolder() / "2026-01-01T00-00-00Z-old.mcap";
  std::ofstream(old) << "";
  fs::resize_file(old, 30'000'000'000);  // sparse: more than the limit that the default once was
  Daemon daemon(home, test::kWallYaml, kTracing);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(writes));
  const Finished stopped = home.control({"--json", "trace", "stop"});
  ASSERT_EQ(stopped.ending, exitedWith(0)) << stopped.errors;
  const std::string name = json::parse(stopped.output).at("name");
  ASSERT_TRUE(daemon.reaches(
      [](const json& status) { return status.at("trace").at("folderBytes") > 30'000'000'000; }));
  EXPECT_EQ(daemon.status().at("trace").at("deleted"), 0);
  EXPECT_TRUE(daemon.status().at("trace").at("folderLimitBytes").is_null());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  EXPECT_TRUE(fs::exists(old) && fs::exists(home.traceFolder() / (name + ".mcap")));
}

TEST(TraceDisk, WhereOnlyProtectedTracesAreLeftATraceWaitsUntilOneIsReleased) {
  const DaemonHome home;
  fs::create_directories(home.traceFolder());
  const std::string name = "2026-01-01T00-00-00Z-kept";
  std::ofstream(home.traceFolder() / (name + ".mcap")) << "";
  fs::resize_file(home.traceFolder() / (name + ".mcap"), 30'000'000);
  std::ofstream(home.traceFolder() / (name + ".keep")) << "";
  std::vector<std::string> set = kTracing;
  set.push_back("trace.max_folder_mb=20");
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  ASSERT_TRUE(daemon.reaches(waits));
  EXPECT_TRUE(contains(detailOf(daemon), "1 traces marked to be kept"));
  EXPECT_EQ(tracesIn(home.traceFolder()).size(), 1U) << "no trace was begun";
  const Finished listed = home.control({"trace", "list"});
  EXPECT_TRUE(contains(listed.output, "2026-01-01 00:00:00Z"));
  EXPECT_TRUE(contains(listed.output, "finished, kept"));
  EXPECT_EQ(home.control({"trace", "delete", name}).ending, exitedWith(1));
  EXPECT_EQ(home.control({"trace", "keep", "--undo", name}).ending, exitedWith(0));
  EXPECT_EQ(home.control({"trace", "delete", name}).ending, exitedWith(0));
  ASSERT_TRUE(daemon.reaches(writes));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(TraceDisk, DepthCountsForTheSizeAtWhichATraceGoesOnInAnotherFile) {
  const DaemonHome home;
  std::vector<std::string> set = kTracing;
  set.insert(set.end(), {"trace.depth=true", "trace.max_file_mb=15", "trace.compression=none"});
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  // ticks alone take 20 s for that; raw depth would be 18 MB/s, and files are looked at once a second
  const auto tooLarge = [](const trace::TraceEntry& trace) { return trace.bytes > 45'000'000; };
  ASSERT_TRUE(test::becomesTrue([&] {
    const auto traces = tracesIn(home.traceFolder());
    return std::ranges::any_of(traces, tooLarge) ||
           std::ranges::any_of(traces, [](const auto& trace) { return !trace.open; });
  }));
  EXPECT_TRUE(std::ranges::none_of(tracesIn(home.traceFolder()), tooLarge));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(StateFolder, ASecondDaemonOnItIsToldWhoHasItAndEnds) {
  const DaemonHome first_home, second_home;
  Daemon first(first_home);
  ASSERT_TRUE(first.answers());
  Daemon second(second_home, test::kWallYaml, {"state.folder=" + first_home.stateFolder().string()});
  EXPECT_EQ(second.wait(), exitedWith(69));
  EXPECT_TRUE(contains(second.errors(), first_home.stateFolder().string()));
  EXPECT_TRUE(contains(second.errors(), "process " + std::to_string(first.pid())));
  EXPECT_TRUE(contains(second.errors(), "give each its own state.folder"));
  first.signal(SIGKILL);
  first.wait();
  Daemon third(first_home);
  EXPECT_TRUE(third.answers()) << "a lock ends with its process";
}

TEST(FlightRecorder, IsWrittenOnRequestAndOnAnOverrunBurst) {
  const DaemonHome home;
  const auto faults = home.path() / "faults.txt";
  std::ofstream(faults) << "3 1 late_ticks\n";
  std::vector<std::string> command = home.command(
      test::kWallYaml,
      {"safety.overrun_burst=5", "control.engage_at_start=true", "control.allow_fault_injection=true"});
  command.insert(command.end(), {"--inject", faults.string()});
  Daemon daemon(home, command);
  ASSERT_TRUE(daemon.answers());
  const Finished dumped = home.control({"--json", "trace", "dump"});
  EXPECT_EQ(dumped.ending, exitedWith(0)) << dumped.errors;
  ASSERT_TRUE(daemon.reaches([](const json& status) {
    return status.at("trace").at("lastDump").get<std::string>().ends_with("overrun-burst");
  }));
  const std::string name = daemon.status().at("trace").at("lastDump");
  bool burst = false;
  trace::TraceVisitor visitor;
  visitor.tick = [&](const rt::Tick& tick) {
    burst = burst || tick.cause == rt::Cause::overrun_burst;
    return true;
  };
  const auto info = trace::readTrace(home.traceFolder() / (name + ".mcap"), visitor);
  ASSERT_TRUE(info) << info.error().text();
  const test::StrictMcap strict = test::readStrictly(home.traceFolder() / (name + ".mcap"));
  EXPECT_EQ(strict.allText(), "");
  EXPECT_TRUE(burst);
  EXPECT_GT(info->ticks, 500U);
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
