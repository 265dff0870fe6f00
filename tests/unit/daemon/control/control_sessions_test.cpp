// SPDX-License-Identifier: Apache-2.0
// What the methods of the control API answer and log, over the real sockets, to the letter:
// sessions/*.golden. Each reply is also of the form that the interface texts describe. The commands of a
// session:
//     METHOD [PARAMETERS] [| POINTER]  the reply, of io.hapticd.Control unless the name says more; `*` in the
//                                      pointer stands for each element
//     log KIND                         the events of this kind
//     box                              fixtures and regions as the box has them
//     changes                          how often the box was changed
//     write FILE TEXT                  writes a file of the state folder
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>

#include "config/additions/addition_reader.h"
#include "config/settings/fixture_settings.h"
#include "control_fixture.h"
#include "interface_definition.h"
#include "tests/support/golden_file.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

/// What stands for several: `spheres(COUNT)`, `tissues(COUNT)`, `several(COUNT, TEXT)` and `letters(COUNT)`.
std::string withRepetitions(std::string text) {
  std::smatch found;
  while (std::regex_search(text, found,
                           std::regex(R"((spheres|tissues|several|letters)\((\d+)(, ([^)]*))?\))"))) {
    std::string all;
    for (int i = 0; i < std::stoi(found[2].str()); ++i) {
      if (found[1] == "letters") all += "a";
      if (found[1] != "letters" && i > 0) all += ",";
      if (found[1] == "spheres") all += fmt::format("sphere(s{}, 0.05)", i);
      if (found[1] == "tissues") all += fmt::format("tissue(t{}, 0, 300)", i);
      if (found[1] == "several") all += found[4].str();
    }
    text = found.prefix().str() + all + found.suffix().str();
  }
  return text;
}

/// What `sphere(NAME, RADIUS)` and `tissue(NAME, X, STIFFNESS)` stand for, and these.
std::string withDefinitions(const std::string& text) {
  const std::string spheres =
      std::regex_replace(withRepetitions(text), std::regex(R"(sphere\((\w+), ([^)]*)\))"),
                         R"({"name":"$1","kind":"sphere","position_m":[0,0,-0.8],"radius_m":$2})");
  return std::regex_replace(
      spheres, std::regex(R"(tissue\((\w+), ([^,]*), ([^)]*)\))"),
      R"({"name":"$1","place":"shape","shape":"sphere","position_m":[$2,0,0],"radius_m":0.1,"stiffness_n_per_m":$3})");
}

/// What is at a pointer.
json valueAt(const json& value, const std::string& pointer) {
  if (pointer.empty()) return value;
  const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
  const std::string name = pointer.substr(1, end - 1), rest = pointer.substr(end);
  if (name != "*") {
    const json::json_pointer here("/" + name);
    return value.contains(here) ? valueAt(value.at(here), rest) : json();
  }
  json all = json::array();
  for (const json& element : value) all.push_back(valueAt(element, rest));
  return all;
}

std::string shortened(const std::string& text) {
  return text.size() > 100 ? text.substr(0, 100) + "..." : text;
}

class ControlSession : public ControlFixture {
 protected:
  std::string answer(const std::string& command) {
    const std::size_t space = std::min(command.find(' '), command.size());
    const std::string name = command.substr(0, space);
    const std::string rest = command.substr(std::min(space + 1, command.size()));
    if (name == "log") return steady(logOf(rest));
    if (name == "box") return additions();
    if (name == "changes") return fmt::format("{}\n", box.changes());
    if (name == "write") return write(rest.substr(0, rest.find(' ')), rest.substr(rest.find(' ') + 1));
    const std::size_t bar = std::min(rest.find("| /"), rest.size());
    std::string parameters = rest.substr(0, bar);
    if (parameters.empty()) parameters = "{}";
    return steady(replyTo(name, withDefinitions(parameters), bar < rest.size() ? rest.substr(bar + 2) : "") +
                  "\n");
  }

 private:
  std::string replyTo(const std::string& name, const std::string& parameters,
                      const std::string& pointer) const {
    const bool reads = name.starts_with("Status.");
    const std::string method = reads                                 ? "io.hapticd." + name
                               : name.find('.') != std::string::npos ? name
                                                                     : "io.hapticd.Control." + name;
    static const std::regex streams("Status.(Monitor|Events|Ticks|GetSnapshot)");
    const std::string more = std::regex_match(name, streams) ? R"(,"more":true})" : "}";
    RawClient client = reads ? statusClient() : controlClient();
    client.call(R"({"method":")" + method + R"(","parameters":)" + parameters + more);
    const json reply = client.json();
    EXPECT_EQ(mismatchOf(method, reply), "") << name << " " << parameters;
    const std::string shown = valueAt(reply.value("parameters", json()), pointer).dump();
    return reply.contains("error") ? reply["error"].get<std::string>() + " " + shown : shown;
  }

  /// What the interface's own text does not say of a reply; empty where it says all.
  std::string mismatchOf(const std::string& method, const json& reply) const {
    const bool refused = reply.contains("error");
    const std::string subject = refused ? reply["error"].get<std::string>() : method;
    const std::size_t dot = subject.rfind('.');
    const json described = askStatus("org.varlink.service.GetInterfaceDescription",
                                     json{{"interface", subject.substr(0, dot)}}.dump());
    if (described.contains("error")) return described.dump();
    const InterfaceDefinition definition(described["parameters"]["description"].get<std::string>());
    const auto& types = refused ? definition.errors : definition.outputs;
    const auto type = types.find(subject.substr(dot + 1));
    if (type == types.end()) return subject + " is not described";
    return definition.mismatch(reply.value("parameters", json::object()), type->second);
  }

  std::string logOf(const std::string& kind) const {
    std::string lines;
    for (const JournalEntry& entry : log()) {
      if (!entry.event || rt::wordOf(*entry.event) != kind) continue;
      lines += shortened(steady(entry.text)) + " |";
      for (const auto& [field, value] : entry.fields) lines += fmt::format(" {}={}", field, shortened(value));
      lines += "\n";
    }
    return lines;
  }

  std::string additions() const {
    std::string lines;
    const config::SceneAdditions all = box.appliedSettings().additions;
    for (const auto& fixture : all.fixtures) lines += config::lineOf(fixture) + "\n";
    for (const auto& region : all.regions) lines += config::lineOf(region) + "\n";
    return lines;
  }

  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = folder.path("state/" + name);
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << "\n";
    return "";
  }

  /// Without what differs from one run to the next: the folder, times, and who calls, which is this process.
  std::string steady(std::string text) const {
    const std::string here = folder.path("");
    for (std::size_t at = 0; (at = text.find(here, at)) != std::string::npos;) text.erase(at, here.size());
    for (const auto& [pattern, mask] :
         {std::pair(fmt::format(R"(uid {} \(pid {}\))", ::getuid(), ::getpid()), "WHO"),
          {fmt::format("UID={} PID={}", ::getuid(), ::getpid()), "WHO"},
          {R"([0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}[-:][0-9]{2}[-:][0-9]{2}Z)", "TIME"},
          {R"~("(timeNs|beginNs)":1[0-9]{18})~", R"("$1":TIME)"},
          {R"(the force is (-?)[0-9.e+]+ s old)", "the force is $1AGE s old"}})
      text = std::regex_replace(text, std::regex(pattern), mask);
    return text;
  }
};

struct Session {
  const char* name;
  std::function<void(config::Settings&)> prepare = [](config::Settings&) {};

  friend std::ostream& operator<<(std::ostream& stream, const Session& session) {
    return stream << session.name;
  }
};

class ControlSessions : public ControlSession, public testing::WithParamInterface<Session> {};

TEST_P(ControlSessions, AreAnsweredAsWritten) {
  config::Settings settings = box.settings();
  GetParam().prepare(settings);
  box.setSettings(settings);
  start();
  hapticd::test::expectTranscript(
      fmt::format("{}/tests/unit/daemon/control/sessions/{}.golden", HAPTICD_SOURCE_FOLDER, GetParam().name),
      [this](const std::string& command) { return answer(command); });
}

void haveFrames(config::Settings& settings) {
  settings.additions.frames = {{.name = "phantom", .timeout_s = 10}, {.name = "bone", .timeout_s = 10}};
}
void allowForces(config::Settings& settings) {
  settings.live.safety.max_external_force_n = 1;
  settings.live.safety.max_external_power_w = 1;
}
void haveLabels(config::Settings& settings) {
  settings.additions.label_image = "labels.pgm";
  settings.additions.regions = {{.name = "liver", .place = rt::TissuePlace::label, .label = 1},
                                {.name = "bone", .place = rt::TissuePlace::label, .label = 2}};
}

INSTANTIATE_TEST_SUITE_P(All, ControlSessions,
                         testing::Values(Session{"additions"}, Session{"calibration"},
                                         Session{"forces", allowForces}, Session{"frames", haveFrames},
                                         Session{"hand"}, Session{"labels", haveLabels},
                                         Session{"parameters"}, Session{"profiles"}, Session{"streams"},
                                         Session{"traces"}, Session{"undo"}),
                         [](const auto& session) { return std::string(session.param.name); });

}  // namespace
}  // namespace hapticd::daemon::test
