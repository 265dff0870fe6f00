// SPDX-License-Identifier: Apache-2.0
// hapticctl trace info, export, plot and recover: on files, without a daemon.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/trace/mcap/trace_file.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/system/hapticctl/hapticctl_home.h"
#include "tests/system/support/terminal_program.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kTicks = 2000;

class HapticctlTraceFiles : public testing::Test {
 protected:
  HapticctlTraceFiles() { writeTrace(trace, madeUpRecords(2, kTicks / 2), kTicks / 2); }

  std::string file(const std::string& name) const { return (home.path() / name).string(); }
  /// Truncates the trace: without the end that closing writes, and within a chunk.
  void cutOff() const { fs::resize_file(trace, fs::file_size(trace) * 6 / 10); }

  HapticctlHome home;
  std::string trace = (home.path() / "a.mcap").string();
};

TEST_F(HapticctlTraceFiles, ExportSaysHowManyRowsItWroteAndWhere) {
  const Finished csv = home.run({"trace", "export", trace, "--out", file("a.csv")});
  EXPECT_EQ(csv.ending, exitedWith(0)) << csv.errors;
  EXPECT_EQ(csv.output, file("a.csv") + ": 2000 rows\n" + file("a.settings.yaml") + ": the settings\n");
  EXPECT_EQ(csv.errors, "") << "progress is for terminals";
  const Finished as_json = home.run({"--json", "trace", "export", trace, "--out", file("b.csv")});
  EXPECT_EQ(json::parse(as_json.output),
            json({{"file", file("b.csv")}, {"rows", 2000}, {"settings", file("b.settings.yaml")}}));
}

TEST_F(HapticctlTraceFiles, TheExampleMakesHdf5WithEveryValueOfTheTrace) {
  const std::string programs =
      "PATH=" + fs::path(HAPTICCTL_PROGRAM).parent_path().string() + ":/usr/bin:/bin";
  const std::vector<std::string> example{"/usr/bin/env", programs, "/usr/bin/python3", HAPTICD_HDF5_EXAMPLE};
  const auto make = [&](const std::string& from, const std::string& to) {
    std::vector<std::string> command = example;
    command.insert(command.end(), {from, to});
    return runToEnd(command);
  };
  const Finished made = make(trace, file("a.h5"));
  ASSERT_EQ(made.ending, exitedWith(0)) << made.errors;
  const MadeUpRecords records = madeUpRecords(2, kTicks / 2);
  const auto tick = std::ranges::find_if(records.ticks, [](const rt::Tick& one) {
    return std::isfinite(rt::norm(one.command_force_n_in_world));
  });
  ASSERT_NE(tick, records.ticks.end());
  const Finished shown =
      runToEnd({"/usr/bin/python3", "-c",
                "import h5py, sys\n"
                "file, row = h5py.File(sys.argv[1]), int(sys.argv[2])\n"
                "print(sorted(file), len(file['ticks/number']), file['ticks/mode'].asstr()[row])\n"
                "print(file['ticks/wakeup_latency_ns'][row], "
                "*file['ticks/command_force_n_in_world'][row].view('u8'))\n"
                "print(file['events/text'].asstr()[1])\n",
                file("a.h5"), std::to_string(tick - records.ticks.begin())});
  ASSERT_EQ(shown.ending, exitedWith(0)) << shown.errors;
  const rt::Vec3& force = tick->command_force_n_in_world;
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  EXPECT_EQ(shown.output,
            fmt::format("['directives', 'events', 'models', 'settings', 'ticks'] 2000 {}\n{} {} {} {}\n{}\n",
                        rt::wordOf(tick->mode), tick->wakeup_latency_ns, bits(force.x), bits(force.y),
                        bits(force.z), records.events[1].text));

  const Finished again = make(trace, file("a.h5"));
  EXPECT_EQ(again.ending, exitedWith(1));
  EXPECT_TRUE(has(again.errors, "exists already")) << again.errors;
  const Finished absent = make(file("absent.mcap"), file("b.h5"));
  EXPECT_EQ(absent.ending, exitedWith(1));
  EXPECT_TRUE(has(absent.errors, "absent.mcap")) << absent.errors;
  EXPECT_FALSE(fs::exists(file("b.h5")));
}

TEST_F(HapticctlTraceFiles, ATraceOfAnOlderVersionIsReadAndWhatItLacksIsNamed) {
  const std::string older = file("older.mcap");
  writeOlderTrace(older, madeUpRecords(1, 50).ticks);
  const Finished info = home.run({"trace", "info", older});
  EXPECT_EQ(info.ending, exitedWith(0)) << info.errors;
  EXPECT_TRUE(has(info.output, "slewed_force_n_in_world of /hapticd/tick: it is of another version"))
      << info.output;
  EXPECT_TRUE(has(info.output, "0.0.7"));
  const json missing = json::parse(home.run({"--json", "trace", "info", older}).output).at("missingFields");
  EXPECT_EQ(missing, json({{"/hapticd/tick", {"slewed_force_n_in_world"}}}));
  for (const auto& [command, out] : {std::pair("export", "a.csv"), std::pair("plot", "a.svg")}) {
    const Finished made = home.run({"trace", command, older, "--out", file(out)});
    EXPECT_EQ(made.ending, exitedWith(0)) << command << ": " << made.errors;
  }
}

TEST_F(HapticctlTraceFiles, ExportReplacesFilesOnlyWithForce) {
  const std::string old = home.folder().write("old.csv", "old");
  const Finished refused = home.run({"trace", "export", trace, "--out", old});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "--force")) << refused.errors;
  EXPECT_EQ(contentOf(old), "old");
  EXPECT_EQ(home.run({"trace", "export", trace, "--out", old, "--force"}).ending, exitedWith(0));
  EXPECT_TRUE(contentOf(old).starts_with("time_s,"));
}

TEST_F(HapticctlTraceFiles, ExportMakesABagOfRos2AndSaysWhatIsInIt) {
  const Finished bag = home.run({"trace", "export", trace, "--format", "rosbag2", "--out", file("bag.mcap")});
  EXPECT_EQ(bag.ending, exitedWith(0)) << bag.errors;
  EXPECT_TRUE(bag.output.starts_with(file("bag.mcap") + ": ")) << bag.output;
  EXPECT_TRUE(bag.output.ends_with(" messages, 0 depth frames\n")) << bag.output;
  EXPECT_EQ(bag.errors, "");
  const Finished as_json = home.run({"--json", "trace", "export", trace, "--format", "rosbag2", "--namespace",
                                     "/left", "--out", file("left.mcap")});
  const json content = json::parse(as_json.output);
  EXPECT_EQ(content.at("file"), file("left.mcap"));
  EXPECT_EQ(content.at("frames"), 0);
  EXPECT_TRUE(bag.output.contains(": " + content.at("messages").dump() + " messages"))
      << bag.output << content;
  EXPECT_TRUE(contentOf(file("left.mcap")).contains("/left/measured_cp"));
  EXPECT_FALSE(contentOf(file("left.mcap")).contains("//left"));
}

TEST_F(HapticctlTraceFiles, ABagIsRefusedOnlyForWhatACsvIsRefusedFor) {
  const auto exported = [this](std::vector<std::string> more) {
    more.insert(more.begin(), {"trace", "export", trace, "--format", "rosbag2"});
    return home.run(more);
  };
  const std::string old = home.folder().write("old.mcap", "old");
  const Finished there = exported({"--out", old});
  EXPECT_EQ(there.ending, exitedWith(1));
  EXPECT_TRUE(has(there.errors, "exists already")) << there.errors;
  EXPECT_EQ(contentOf(old), "old");
  EXPECT_EQ(exported({"--out", old, "--force"}).ending, exitedWith(0));
  EXPECT_TRUE(contentOf(old).starts_with("\x89MCAP0"));
  EXPECT_TRUE(has(exported({"--out", trace, "--force"}).errors, "is the trace itself"));
  EXPECT_TRUE(has(exported({"--out", file("bag.db3")}).errors, "end the name in .mcap"));
  const Finished name = exported({"--namespace", "9lives", "--out", file("bag.mcap")});
  EXPECT_EQ(name.ending, exitedWith(2));
  EXPECT_TRUE(has(name.errors, "letters, digits and underscores")) << name.errors;
  EXPECT_TRUE(
      has(exported({"--from", "2", "--to", "1", "--out", file("bag.mcap")}).errors, "is not a time range"));
  cutOff();
  const Finished csv = home.run({"trace", "export", trace, "--out", file("a.csv")});
  const Finished damaged = exported({"--out", file("bag.mcap")});
  EXPECT_EQ(damaged.ending, csv.ending);
  EXPECT_EQ(damaged.errors, csv.errors);
  EXPECT_FALSE(fs::exists(file("bag.mcap")));
}

TEST_F(HapticctlTraceFiles, ABagIsNotTakenForATrace) {
  const std::string bag = file("bag.mcap");
  const Finished made = home.run({"trace", "export", trace, "--format", "rosbag2", "--out", bag});
  ASSERT_EQ(made.ending, exitedWith(0)) << made.errors;
  const std::string before = contentOf(bag);
  const std::vector<std::vector<std::string>> commands{{"info", bag},
                                                       {"breaches", bag},
                                                       {"export", bag, "--out", file("a.csv")},
                                                       {"plot", bag, "--out", file("a.svg")},
                                                       {"recover", bag, "--out", file("recovered.mcap")}};
  for (std::vector<std::string> command : commands) {
    command.insert(command.begin(), "trace");
    const Finished refused = home.run(command);
    EXPECT_EQ(refused.ending, exitedWith(1)) << command[1];
    EXPECT_TRUE(has(refused.errors, bag + ": is a bag of ROS 2 and not a trace of hapticd"))
        << command[1] << ": " << refused.errors;
  }
  EXPECT_FALSE(fs::exists(file("recovered.mcap")));
  EXPECT_EQ(contentOf(bag), before);
}

TEST_F(HapticctlTraceFiles, NothingReplacesTheTraceItself) {
  const std::string before = contentOf(trace);
  const std::string picture = file("a.png");
  fs::create_symlink(trace, picture);
  for (const auto& [command, out] : {std::pair("export", trace), std::pair("plot", picture)}) {
    const Finished refused = home.run({"trace", command, trace, "--out", out, "--force"});
    EXPECT_EQ(refused.ending, exitedWith(1));
    EXPECT_TRUE(has(refused.errors, "is the trace itself")) << refused.errors;
  }
  EXPECT_EQ(contentOf(trace), before);
}

TEST_F(HapticctlTraceFiles, RecoverSaysWhatItKeptAndInfoThenReads) {
  cutOff();
  fs::rename(trace, trace::partOf(trace));
  const std::string before = contentOf(trace::partOf(trace));
  const Finished broken = home.run({"trace", "info", trace::partOf(trace)});
  EXPECT_TRUE(has(broken.output + broken.errors, "trace recover")) << broken.output << broken.errors;
  const Finished recovered = home.run({"--json", "trace", "recover", trace::partOf(trace)});
  ASSERT_EQ(recovered.ending, exitedWith(0)) << recovered.errors;
  EXPECT_EQ(contentOf(trace::partOf(trace)), before) << "it is only read";
  const json said = json::parse(recovered.output);
  EXPECT_EQ(said.at("file"), file("a-recovered.mcap"));
  EXPECT_EQ(said.at("chunks"), 1);
  EXPECT_GT(said.at("bytesLost"), 0);
  EXPECT_FALSE(said.at("damage").empty());
  const Finished info = home.run({"--json", "trace", "info", file("a-recovered.mcap")});
  EXPECT_EQ(json::parse(info.output).at("complete"), true);
  EXPECT_EQ(json::parse(info.output).at("ticks"), kTicks / 2);
}

TEST_F(HapticctlTraceFiles, RecoverKeepsWhatIsBehindTheDamageAndOverwritesNothing) {
  std::string bytes = contentOf(trace);
  bytes[bytes.size() / 4] ^= 1;  // in the first of two chunks
  const std::string damaged = home.folder().write("b.mcap", bytes);
  const Finished recovered = home.run({"trace", "recover", damaged, "--out", file("c.mcap")});
  ASSERT_EQ(recovered.ending, exitedWith(0)) << recovered.errors;
  for (const char* said : {"damaged      bytes", "the chunk", "1 chunk kept", "is left as it was"}) {
    EXPECT_TRUE(has(recovered.output, said)) << recovered.output << " lacks: " << said;
  }
  EXPECT_EQ(contentOf(damaged), bytes);
  EXPECT_EQ(json::parse(home.run({"--json", "trace", "info", file("c.mcap")}).output).at("ticks"),
            kTicks / 2);
  const Finished again = home.run({"trace", "recover", damaged, "--out", file("c.mcap")});
  EXPECT_EQ(again.ending, exitedWith(1));
  EXPECT_TRUE(has(again.errors, "already exists")) << again.errors;
  const Finished whole = home.run({"trace", "recover", trace});
  EXPECT_EQ(whole.ending, exitedWith(0));
  EXPECT_TRUE(has(whole.output, "nothing is wrong with it")) << whole.output;
  EXPECT_FALSE(fs::exists(file("a-recovered.mcap")));
}

TEST_F(HapticctlTraceFiles, LongWorkShowsHowFarItIsOnATerminal) {
  TerminalProgram program(home.command({"trace", "export", trace, "--out", file("a.csv")}), {"TERM=xterm"},
                          24, 80);
  EXPECT_EQ(program.wait(), exitedWith(0));
  EXPECT_TRUE(has(program.output(), "exporting")) << program.output();
  EXPECT_TRUE(has(program.output(), "2000 rows")) << program.output();
}

}  // namespace
}  // namespace hapticd::test
