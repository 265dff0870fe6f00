// SPDX-License-Identifier: Apache-2.0
// Traces as clients see them, over the real sockets.
#include <gtest/gtest.h>

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
};

TEST_F(TraceMethodsTest, StartsStopsListsAndDeletes) {
  start();
  EXPECT_EQ("trace-0-grip", ask("StartTrace", {{"label", "grip"}, {"depth", true}})["parameters"]["name"]);
  const json listed = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  EXPECT_EQ(R"([{"name":"trace-0-grip","bytes":0,"timeNs":5000,"open":true,"damaged":false,
                 "depth":true,"kept":false,"note":"","beginNs":0,"clockIsSet":null,"number":0}])"_json,
            listed["traces"]);
  EXPECT_EQ(json(folder.path("state/traces")), listed["folder"]);
  EXPECT_EQ(0, listed["omitted"]);
  EXPECT_EQ("trace-0-grip", ask("StopTrace")["parameters"]["name"]);
  EXPECT_EQ("trace-1-dump", ask("DumpTrace")["parameters"]["name"]);
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("DeleteTrace", {{"name", "trace-0-grip"}}));
  EXPECT_EQ(json({"trace-1-dump"}), names());
}

TEST_F(TraceMethodsTest, MarksTracesToBeKeptAndLogsIt) {
  start();
  box.setTraces(2);
  const auto kept = [&] {
    const json reply = askStatus("io.hapticd.Status.ListTraces");
    return json{reply["parameters"]["traces"][0]["kept"], reply["parameters"]["traces"][1]["kept"]};
  };
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("KeepTrace", {{"name", "trace-1"}, {"keep", true}}));
  EXPECT_EQ(json({false, true}), kept());
  EXPECT_EQ(json({{"parameters", json::object()}}), ask("KeepTrace", {{"name", "trace-1"}, {"keep", false}}));
  EXPECT_EQ(json({false, false}), kept());
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("KeepTrace", {{"name", "x"}, {"keep", true}})["error"]);
  EXPECT_EQ(invalidParameter("keep"), ask("KeepTrace", {{"name", "trace-1"}, {"keep", "yes"}}));
  EXPECT_EQ(invalidParameter("name"), ask("KeepTrace", {{"keep", true}}));
  ask("KeepTrace", {{"name", "trace-0"}});
  EXPECT_EQ(json({true, false}), kept());
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(3U, entries.size());
  EXPECT_EQ("keep", entries[0].at("ACTION"));
  EXPECT_EQ("unkeep", entries[1].at("ACTION"));
  EXPECT_EQ("trace-1", entries[1].at("TRACE"));
}

TEST_F(TraceMethodsTest, NotesAreListedAndLogged) {
  start();
  box.setTraces(1);
  EXPECT_EQ(json({{"parameters", json::object()}}),
            ask("NoteTrace", {{"name", "trace-0"}, {"text", "good one"}}));
  EXPECT_EQ("good one", askStatus("io.hapticd.Status.ListTraces")["parameters"]["traces"][0]["note"]);
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("NoteTrace", {{"name", "x"}, {"text", "y"}})["error"]);
  EXPECT_EQ(invalidParameter("text"), ask("NoteTrace", {{"name", "trace-0"}, {"text", 7}}));
  EXPECT_EQ(invalidParameter("name"), ask("NoteTrace", {{"text", "y"}}));
  ask("NoteTrace", {{"name", "trace-0"}});
  EXPECT_EQ("", askStatus("io.hapticd.Status.ListTraces")["parameters"]["traces"][0]["note"]);
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(2U, entries.size());
  EXPECT_EQ("note", entries[0].at("ACTION"));
}

TEST_F(TraceMethodsTest, MarksGoIntoTheLogWhileATraceIsWritten) {
  start();
  EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("MarkTrace", {{"text", "too early"}})["error"]);
  BoxStatus status = box.status();
  status.trace.state = TraceState::writing;
  status.trace.name = "trace-0";
  box.setStatus(status);
  EXPECT_EQ("trace-0", ask("MarkTrace", {{"text", "begin of trial 3"}})["parameters"]["name"]);
  const auto entries = logged(config::EventKind::mark);
  ASSERT_EQ(1U, entries.size());
  EXPECT_EQ("begin of trial 3", entries[0].at("MARK"));
  EXPECT_EQ("trace-0", entries[0].at("TRACE"));
  for (const std::string& text : {std::string(), std::string("two\nlines"), std::string(201, 'a')}) {
    EXPECT_EQ("io.hapticd.Control.TraceFailed", ask("MarkTrace", {{"text", text}})["error"]) << text;
  }
  EXPECT_EQ(invalidParameter("text"), ask("MarkTrace"));
}

TEST_F(TraceMethodsTest, ManyLongNotesLeaveOutTheOldestTracesNotTheReply) {
  start();
  box.setTraces(1000, std::string(200, '"'));
  const json reply = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  const std::size_t listed = reply["traces"].size();
  EXPECT_LT(listed, 1000U);
  EXPECT_EQ(1000U, listed + reply["omitted"].get<std::size_t>());
  EXPECT_EQ("trace-999", reply["traces"].back()["name"]);
}

TEST_F(TraceMethodsTest, TakesDepthFromTheConfigurationWhereNothingIsSaid) {
  config::Settings settings = box.settings();
  settings.trace.depth = true;
  box.setSettings(settings);
  start();
  ask("StartTrace");
  EXPECT_EQ(true, askStatus("io.hapticd.Status.ListTraces")["parameters"]["traces"][0]["depth"]);
}

TEST_F(TraceMethodsTest, SaysWhyAndWhatToDoWhenTheBoxCannot) {
  start();
  const auto failure = [](const std::string& reason) {
    return errorReply("io.hapticd.Control.TraceFailed", {{"reason", reason}});
  };
  EXPECT_EQ(failure("trace: none is being written (start one)"), ask("StopTrace"));
  ask("StartTrace");
  EXPECT_EQ(failure("trace: one is being written (stop it first)"), ask("StartTrace"));
  EXPECT_EQ(failure("trace trace-0: there is no such finished trace (list them)"),
            ask("DeleteTrace", {{"name", "trace-0"}}));
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
  ask("StartTrace");
  ask("StopTrace");
  ask("StopTrace");  // fails: nothing is done
  ask("DumpTrace");
  ask("DeleteTrace", {{"name", "trace-0"}});
  const auto entries = logged(config::EventKind::trace);
  ASSERT_EQ(4U, entries.size());
  const char* actions[] = {"start", "stop", "dump", "delete"};
  const char* traces[] = {"trace-0", "trace-0", "trace-1-dump", "trace-0"};
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
  EXPECT_EQ(R"({"parameters":{"name":"trace-0"}})"_json, starter.json());
}

TEST_F(TraceMethodsTest, FinishesAndLogsWhatAClientThatLeftHasBegun) {
  start();
  box.holdJobs();
  RawClient starter = controlClient();
  starter.call(R"({"method":"io.hapticd.Control.StartTrace"})");
  EXPECT_TRUE(box.waitForJobs(1));
  starter.close();
  box.finishJobs();
  EXPECT_EQ(json({"trace-0"}), names());
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
  EXPECT_FALSE(box.waitForJobs(65, std::chrono::seconds(0)));
  box.finishJobs();
  while (logged(config::EventKind::trace).size() < 32) askStatus("io.hapticd.Status.GetStatus");
  EXPECT_TRUE(ask("DumpTrace").contains("parameters"));
}

TEST_F(TraceMethodsTest, ListsTheNewestThousand) {
  box.setTraces(1234);
  start();
  const json listed = askStatus("io.hapticd.Status.ListTraces")["parameters"];
  EXPECT_EQ(1000U, listed["traces"].size());
  EXPECT_EQ("trace-234", listed["traces"].front()["name"]);
  EXPECT_EQ("trace-1233", listed["traces"].back()["name"]);
  EXPECT_EQ(234, listed["omitted"]);
}

}  // namespace
}  // namespace hapticd::daemon::test
