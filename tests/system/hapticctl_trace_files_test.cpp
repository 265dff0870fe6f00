// SPDX-License-Identifier: Apache-2.0
// hapticctl trace info, export, plot and recover: on files, without a daemon.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "drivers/trace/trace_file.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/system/hapticctl_home.h"
#include "tests/system/terminal_program.h"

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
  const Finished hdf5 = home.run({"--json", "trace", "export", trace, "--out", file("a.h5")});
  EXPECT_EQ(json::parse(hdf5.output).at("file"), file("a.h5"));
  EXPECT_TRUE(contentOf(file("a.h5")).starts_with("\x89HDF"));
}

TEST_F(HapticctlTraceFiles, Hdf5IsWrittenByAProgramThatIsRunAndItsErrorsAreShown) {
  const std::string old = home.folder().write("old.h5", "old");
  const Finished refused = home.run({"trace", "export", trace, "--out", old});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "--force")) << refused.errors;
  EXPECT_EQ(contentOf(old), "old");
  const Finished absent = home.run({"--json", "trace", "export", file("absent.mcap"), "--out", file("a.h5")});
  EXPECT_EQ(absent.ending, exitedWith(1));
  EXPECT_TRUE(has(absent.errors, "absent.mcap")) << absent.errors;
  EXPECT_EQ(home.run({"trace", "export", trace, "--out", old, "--force"}).ending, exitedWith(0));
  EXPECT_TRUE(contentOf(old).starts_with("\x89HDF"));
}

TEST_F(HapticctlTraceFiles, WhereTheToolsAreNotInstalledHdf5NamesTheirPackageAndCsvIsWritten) {
  const std::string alone = file("hapticctl");
  fs::copy_file(HAPTICCTL_PROGRAM, alone);
  const Finished hdf5 = runToEnd({alone, "trace", "export", trace, "--out", file("a.h5")});
  EXPECT_EQ(hdf5.ending, exitedWith(1));
  EXPECT_TRUE(has(hdf5.errors, "install the package hapticd-tools")) << hdf5.errors;
  EXPECT_FALSE(fs::exists(file("a.h5")));
  EXPECT_EQ(runToEnd({alone, "trace", "export", trace, "--out", file("a.csv")}).ending, exitedWith(0));
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
  fs::rename(trace, drivers::partOf(trace));
  const std::string before = contentOf(drivers::partOf(trace));
  const Finished broken = home.run({"trace", "info", drivers::partOf(trace)});
  EXPECT_TRUE(has(broken.output + broken.errors, "trace recover")) << broken.output << broken.errors;
  const Finished recovered = home.run({"--json", "trace", "recover", drivers::partOf(trace)});
  ASSERT_EQ(recovered.ending, exitedWith(0)) << recovered.errors;
  EXPECT_EQ(contentOf(drivers::partOf(trace)), before) << "it is only read";
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
  for (const char* said : {"damaged      bytes", "the chunk", "1 chunks kept", "is left as it was"}) {
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
