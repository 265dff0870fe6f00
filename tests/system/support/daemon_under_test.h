// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

/// The built programs as processes. Their paths come from CMake.
namespace hapticd::test {

/// A camera that sees a wall 1 m away, and a hand that stays within 35 mm of it: there is contact from the
/// first frame to the last. Time limits are wide, so that only what a test stops becomes stale.
inline constexpr const char* kWallYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}\n"
    "camera: {driver: synthetic}\n"
    "synthetic: {scene: plane, noise: off, distance_m: 1}\n"
    "simulated_handle: {start_z_m: -0.97, travel_m: 0.02, stroke_m: 0.01}\n";

/// A folder with the sockets of a daemon, which may be started in it several times.
class DaemonHome {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  std::string statusSocket() const { return path() / "Status"; }
  std::string controlSocket() const { return path() / "Control"; }
  /// The state folder of a daemon that is started here; it is created when the daemon first writes to it.
  std::filesystem::path stateFolder() const { return path() / "state"; }
  std::filesystem::path traceFolder() const { return stateFolder() / "traces"; }
  /// Writes hapticd.yaml and returns the command that starts hapticd with it on the sockets here; `set`:
  /// further assignments for --set.
  std::vector<std::string> command(const std::string& yaml, const std::vector<std::string>& set = {}) const;
  /// Returns the names of the files in the folder, sorted.
  std::vector<std::string> entries() const;
  /// The command that runs hapticctl on the control socket.
  std::vector<std::string> controlCommand(std::vector<std::string> arguments) const;
  /// Runs it.
  Finished control(const std::vector<std::string>& arguments, const ProgramOptions& options = {}) const;
  /// Runs it with these bytes on stdin.
  Finished controlWithInput(const std::string& input, const std::vector<std::string>& arguments) const;
  /// Writes a file in the folder and returns its path.
  std::string write(const std::string& name, const std::string& content) const {
    return folder_.write(name, content).string();
  }
  /// Gives the folder to another user.
  void giveTo(uid_t user) const;

 private:
  TemporaryFolder folder_;
};

/// A running hapticd.
class Daemon : public Program {
 public:
  explicit Daemon(const DaemonHome& home, const std::string& yaml = kWallYaml,
                  const std::vector<std::string>& set = {}, const ProgramOptions& options = {});
  /// `command`: from DaemonHome::command(), with further arguments.
  Daemon(const DaemonHome& home, const std::vector<std::string>& command, const ProgramOptions& options = {})
      : Program(command, options), home_(home) {}

  /// Waits until it responds on its sockets; if it ends before that, the test fails with its output.
  bool answers();
  /// Returns its whole status; null (and a failed test) if it does not respond.
  nlohmann::json status();
  /// Polls the status until `condition` holds of it; false, and the last status is shown, when it does not in
  /// time.
  template <typename Condition>
  bool reaches(Condition condition) {
    nlohmann::json last;
    const bool reached = becomesTrue([&] {
      last = status();
      return last.is_null() || condition(last);
    });
    if (!reached || last.is_null()) showFailure(last);
    return reached && !last.is_null();
  }
  /// Returns true if the force loop ticks at least once more.
  bool ticks();
  /// Sends SIGTERM and waits for its end.
  Ending terminate();

 private:
  void showFailure(const nlohmann::json& last) const;

  const DaemonHome& home_;
};

std::vector<std::string> hapticdCommand(std::vector<std::string> arguments);
std::vector<std::string> hapticctlCommand(std::vector<std::string> arguments);
std::vector<std::string> hapticReplayCommand(std::vector<std::string> arguments);

/// Converts an object with `x`, `y` and `z`; NaN for null.
rt::Vec3 vectorOf(const nlohmann::json& object);
double lengthOf(const nlohmann::json& object);

/// Whether `text` holds `part`, with both shown if not.
testing::AssertionResult contains(const std::string& text, const std::string& part);

}  // namespace hapticd::test
