// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/daemon_under_test.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::test {
namespace {

std::vector<std::string> commandOf(const char* program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program);
  return arguments;
}

}  // namespace

std::vector<std::string> hapticdCommand(std::vector<std::string> arguments) {
  return commandOf(HAPTICD_PROGRAM, std::move(arguments));
}

std::vector<std::string> hapticctlCommand(std::vector<std::string> arguments) {
  return commandOf(HAPTICCTL_PROGRAM, std::move(arguments));
}

std::vector<std::string> hapticReplayCommand(std::vector<std::string> arguments) {
  return commandOf(HAPTIC_REPLAY_PROGRAM, std::move(arguments));
}

std::vector<std::string> DaemonHome::command(const std::string& yaml,
                                             const std::vector<std::string>& set) const {
  std::vector<std::string> arguments{
      "--config",
      folder_.write("hapticd.yaml", yaml).string(),
      "--set=control.status_socket=" + statusSocket(),
      "--set=control.control_socket=" + controlSocket(),
      "--set=state.folder=" + stateFolder().string(),
      "--set=force.law=nearest_springs"};  // forces to be compared are the paper's
  for (const std::string& assignment : set) arguments.push_back("--set=" + assignment);
  return hapticdCommand(arguments);
}

std::vector<std::string> DaemonHome::entries() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(path())) {
    if (entry.path() != stateFolder()) names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> DaemonHome::controlCommand(std::vector<std::string> arguments) const {
  arguments.insert(arguments.begin(), {"--socket", controlSocket()});
  return hapticctlCommand(std::move(arguments));
}

Finished DaemonHome::control(const std::vector<std::string>& arguments, const ProgramOptions& options) const {
  return runToEnd(controlCommand(arguments), options);
}

Finished DaemonHome::controlWithInput(const std::string& input,
                                      const std::vector<std::string>& arguments) const {
  std::vector<std::string> line{"/bin/sh", "-c", "exec \"$@\" < '" + write("input", input) + "'", "sh"};
  for (const std::string& word : controlCommand(arguments)) line.push_back(word);
  return runToEnd(line);
}

void DaemonHome::giveTo(uid_t user) const {
  EXPECT_EQ(::chown(path().c_str(), user, user), 0);
}

Daemon::Daemon(const DaemonHome& home, const std::string& yaml, const std::vector<std::string>& set,
               const ProgramOptions& options)
    : Program(home.command(yaml, set), options), home_(home) {}

bool Daemon::answers() {
  const bool answered = becomesTrue([this] {
    return !running() || (std::filesystem::exists(home_.controlSocket()) &&
                          home_.control({"--json", "status"}).ending == exitedWith(0));
  });
  if (answered && running()) return true;
  ADD_FAILURE() << "hapticd does not respond; its output: " << errors();
  return false;
}

nlohmann::json Daemon::status() {
  const Finished reply = home_.control({"--json", "status"});
  if (reply.ending != exitedWith(0)) {
    ADD_FAILURE() << "no status: " << reply.errors << "\nhapticd said: " << errors();
    return {};
  }
  return nlohmann::json::parse(reply.output).at("status");
}

bool Daemon::ticks() {
  const auto ticksOf = [](const nlohmann::json& status) {
    return status.at("loop").at("counters").at("ticks").get<std::uint64_t>();
  };
  const nlohmann::json before = status();
  if (before.is_null()) return false;
  return reaches([&](const nlohmann::json& status) { return ticksOf(status) > ticksOf(before); });
}

Ending Daemon::terminate() {
  signal(SIGTERM);
  return wait();
}

void Daemon::showFailure(const nlohmann::json& last) const {
  ADD_FAILURE() << "the status never became as expected: " << last.dump(2) << "\nhapticd said: " << errors();
}

rt::Vec3 vectorOf(const nlohmann::json& object) {
  const auto coordinate = [&object](const char* name) {
    const nlohmann::json& value = object.at(name);
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
  };
  return {coordinate("x"), coordinate("y"), coordinate("z")};
}

double lengthOf(const nlohmann::json& object) {
  return norm(vectorOf(object));
}

testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "there is no \"" << part << "\" in: " << text;
}

}  // namespace hapticd::test
