// SPDX-License-Identifier: Apache-2.0
// Traces as clients see them, over the real sockets.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

class TraceMethodsTest : public ControlFixture {
 protected:
  json ask(const std::string& method, const json& parameters = json::object()) {
    return askControl("io.hapticd.Control." + method, parameters.dump());
  }
  json names() {
    json names = json::array();
    const json reply = askStatus("io.hapticd.Status.ListTraces");
    for (const json& trace : reply["parameters"]["traces"]) names.push_back(trace["name"]);
    return names;
  }
  json firstTrace() { return askStatus("io.hapticd.Status.ListTraces")["parameters"]["traces"][0]; }
  /// Writes a trace and returns its name.
  std::string makeTrace() {
    ask("StartTrace");
    return ask("StopTrace")["parameters"]["name"];
  }
  /// Puts finished traces, without content, beside those of the box: trace-0000, trace-0001, ...
  void addTraceFiles(int count, const std::string& note = "") const {
    std::filesystem::create_directories(folder.path("state/traces"));
    for (int i = 0; i < count; ++i) {
      const std::string file = folder.path(fmt::format("state/traces/trace-{:04}", i));
      std::ofstream(file + ".mcap");
      if (!note.empty()) std::ofstream(file + ".note") << note;
    }
  }
  void expectFailure(const json& reply, const std::string& part) {
    EXPECT_EQ("io.hapticd.Control.TraceFailed", reply["error"]);
    const std::string reason = reply["parameters"]["reason"];
    EXPECT_NE(std::string::npos, reason.find(part)) << reason;
    EXPECT_EQ(')', reason.back()) << "what to do about it: " << reason;
  }
};

TEST_F(TraceMethodsTest, StartsStopsListsAndDeletes) {
  start();
  const std::string name = ask("StartTrace", {{"label", "grip"}, {"depth", true}})["parameters"]["name"];
  EXPECT_TRUE(name.ends_with("Z-grip")) << name;
  const json listed = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  json trace = listed["traces"][0];
  EXPECT_LT(1'600'000'000'000'000'000, trace["timeNs"]);
  EXPECT_LT(1'600'000'000'000'000'000, trace["beginNs"]);
  for (const char* varies : {"timeNs", "beginNs", "bytes", "clockIsSet"}) trace.erase(varies);
  EXPECT_EQ(json({{"name", name},
                  {"open", true},
                  {"damaged", false},
                  {"depth", true},
                  {"kept", false},
                  {"note", ""},
                  {"number", 1}}),
            trace);
  EXPECT_EQ(json(folder.path("state/traces")), listed["folder"]);
  EXPECT_EQ(0, listed["omitted"]);
  EXPECT_EQ(name, ask("StopTrace")["parameters"]["name"]);
  EXPECT_EQ(false, firstTrace()["open"]);
  const std::string dump = ask("DumpTrace")["parameters"]["name"];
  EXPECT_TRUE(dump.ends_with("Z-dump")) << dump;
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("DeleteTrace", {{"name", name}}));
  EXPECT_EQ(json({dump}), names());
}

TEST_F(TraceMethodsTest, MarksTracesToBeKeptAndLogsIt) {
  start();
  const std::string first = makeTrace();
  const std::string second = makeTrace();
  const auto kept = [&] {
    const json reply = askStatus("io.hapticd.Status.ListTraces");
    return json{reply["parameters"]["traces"][0]["kept"], reply["parameters"]["traces"][1]["kept"]};
  };
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("KeepTrace", {{"name", second}, {"keep", true}}));
  EXPECT_EQ(json({false, true}), kept());
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("KeepTrace", {{"name", second}, {"keep", false}}));
  EXPECT_EQ(json({false, false}), kept());
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("KeepTrace", {{"name", "x"}, {"keep", true}})["error"]);
  EXPECT_EQ(invalidParameter("keep"), ask("KeepTrace", {{"name", second}, {"keep", "yes"}}));
  EXPECT_EQ(invalidParameter("name"), ask("KeepTrace", {{"keep", true}}));
  ask("KeepTrace", {{"name", first}});
  EXPECT_EQ(json({true, false}), kept());
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(7U, entries.size()) << "start and stop of both, before";
  EXPECT_EQ("keep", entries[4].at("ACTION"));
  EXPECT_EQ("unkeep", entries[5].at("ACTION"));
  EXPECT_EQ(second, entries[5].at("TRACE"));
}

TEST_F(TraceMethodsTest, NotesAreListedAndLogged) {
  start();
  const std::string name = makeTrace();
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("NoteTrace", {{"name", name}, {"text", "good one"}}));
  EXPECT_EQ("good one", firstTrace()["note"]);
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("NoteTrace", {{"name", "x"}, {"text", "y"}})["error"]);
  EXPECT_EQ(invalidParameter("text"), ask("NoteTrace", {{"name", name}, {"text", 7}}));
  EXPECT_EQ(invalidParameter("name"), ask("NoteTrace", {{"text", "y"}}));
  ask("NoteTrace", {{"name", name}});
  EXPECT_EQ("", firstTrace()["note"]);
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(4U, entries.size());
  EXPECT_EQ("note", entries[2].at("ACTION"));
}

TEST_F(TraceMethodsTest, MarksGoIntoTheLogWhileATraceIsWritten) {
  start();
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("MarkTrace", {{"text", "too early"}})["error"]);
  const json name = ask("StartTrace")["parameters"]["name"];
  EXPECT_EQ(name, ask("MarkTrace", {{"text", "begin of trial 3"}})["parameters"]["name"]);
  const auto entries = logged(config::EventKind::mark);
  ASSERT_EQ(1U, entries.size());
  EXPECT_EQ("begin of trial 3", entries[0].at("MARK"));
  EXPECT_EQ(name, json(entries[0].at("TRACE")));
  for (const std::string& text : {std::string(), std::string("two\nlines"), std::string(201, 'a')}) {
    EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("MarkTrace", {{"text", text}})["error"]) << text;
  }
  EXPECT_EQ(invalidParameter("text"), ask("MarkTrace"));
}

TEST_F(TraceMethodsTest, ManyLongNotesLeaveOutTheOldestTracesNotTheReply) {
  addTraceFiles(1000, std::string(200, '"'));
  start();
  const json reply = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  const std::size_t listed = reply["traces"].size();
  EXPECT_LT(listed, 1000U);
  EXPECT_EQ(1000U, listed + reply["omitted"].get<std::size_t>());
  EXPECT_EQ("trace-0999", reply["traces"].back()["name"]);
}

TEST_F(TraceMethodsTest, TakesDepthFromTheConfigurationWhereNothingIsSaid) {
  config::Settings settings = box.settings();
  settings.trace.depth = true;
  box.setSettings(settings);
  start();
  ask("StartTrace");
  EXPECT_EQ(true, firstTrace()["depth"]);
}

TEST_F(TraceMethodsTest, SaysWhyAndWhatToDoWhenTheBoxCannot) {
  start();
  expectFailure(ask("StopTrace"), "none is being written");
  const json name = ask("StartTrace")["parameters"]["name"];
  expectFailure(ask("StartTrace"), "a trace is already being recorded");
  expectFailure(ask("DeleteTrace", {{"name", name}}), "is being written");
}

TEST_F(TraceMethodsTest, RefusesLabelsThatAreNoPartOfAName) {
  start();
  for (const char* label : {"../x", "a b", "a/b", "\xc3\xa9", "a\nb"}) {
    EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("StartTrace", {{"label", label}})["error"]) << label;
  }
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("StartTrace", {{"label", std::string(65, 'a')}})["error"]);
  EXPECT_EQ(json::array(), names());
  EXPECT_TRUE(log().empty());
  EXPECT_EQ(invalidParameter("label"), ask("StartTrace", {{"label", 7}}));
  EXPECT_EQ(invalidParameter("depth"), ask("StartTrace", {{"depth", "yes"}}));
  EXPECT_EQ(invalidParameter("name"), ask("DeleteTrace"));
  EXPECT_TRUE(ask("StartTrace", {{"label", std::string(64, 'a')}}).contains("parameters"));
}

TEST_F(TraceMethodsTest, LogsWhatWasDoneAndByWhom) {
  start();
  const std::string name = makeTrace();
  ask("StopTrace");  // fails: nothing is done
  const std::string dump = ask("DumpTrace")["parameters"]["name"];
  ask("DeleteTrace", {{"name", name}});
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(4U, entries.size());
  const char* actions[] = {"start", "stop", "dump", "delete"};
  const std::string traces[] = {name, name, dump, name};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(actions[i], entries[i].at("ACTION"));
    EXPECT_EQ(traces[i], entries[i].at("TRACE"));
    EXPECT_EQ(std::to_string(::getuid()), entries[i].at("UID"));
    EXPECT_EQ(std::to_string(::getpid()), entries[i].at("PID"));
  }
}

TEST_F(TraceMethodsTest, ServesOthersWhileTheDiskTakesItsTime) {
  start();
  box.holdJobs();
  RawClient starter = controlClient();
  starter.call(R"({"method":"io.hapticd.Control.StartTrace"})");
  EXPECT_TRUE(box.waitForJobs(1));
  EXPECT_EQ("idle", askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["mode"]);
  EXPECT_TRUE(starter.silent());
  box.finishJobs();
  EXPECT_TRUE(starter.json()["parameters"]["name"].is_string());
}

TEST_F(TraceMethodsTest, FinishesAndLogsWhatAClientThatLeftHasBegun) {
  start();
  box.holdJobs();
  RawClient starter = controlClient();
  starter.call(R"({"method":"io.hapticd.Control.StartTrace"})");
  EXPECT_TRUE(box.waitForJobs(1));
  starter.close();
  box.finishJobs();
  EXPECT_EQ(1U, names().size());
  while (logged(config::EventKind::trace).empty()) askStatus("io.hapticd.Status.GetStatus");
  EXPECT_EQ(1U, logged(config::EventKind::trace).size());
}

TEST_F(TraceMethodsTest, RefusesWhatWouldWaitBehindTooManyOthersAndKeepsPlacesForChanges) {
  start();
  box.holdJobs();
  std::vector<RawClient> readers;
  for (int i = 0; i < 32; ++i) {
    readers.push_back(statusClient());
    readers.back().call(R"({"method":"io.hapticd.Status.ListTraces"})");
  }
  ASSERT_TRUE(box.waitForJobs(32));
  EXPECT_EQ("io.hapticd.Status.ListFailed", askStatus("io.hapticd.Status.ListTraces")["error"]);
  RawClient changer = controlClient();
  for (int i = 0; i < 100; ++i) {
    changer.call(R"({"method":"io.hapticd.Control.DumpTrace","oneway":true})");
  }
  ASSERT_TRUE(box.waitForJobs(64));
  const json refused = ask("DumpTrace");
  EXPECT_EQ("io.hapticd.Control.TraceFailed", refused["error"]);
  EXPECT_EQ(64, box.jobs());
  box.finishJobs();
  while (logged(config::EventKind::trace).size() < 32) askStatus("io.hapticd.Status.GetStatus");
  EXPECT_TRUE(ask("DumpTrace").contains("parameters"));
}

TEST_F(TraceMethodsTest, ListsTheNewestThousand) {
  addTraceFiles(1234);
  start();
  const json listed = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  EXPECT_EQ(1000U, listed["traces"].size());
  EXPECT_EQ("trace-0234", listed["traces"].front()["name"]);
  EXPECT_EQ("trace-1233", listed["traces"].back()["name"]);
  EXPECT_EQ(234, listed["omitted"]);
}

}  // namespace
}  // namespace hapticd::daemon::test
