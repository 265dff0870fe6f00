// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::test {

/// Long enough for a loaded machine under a sanitizer; only a failing test waits that long.
inline constexpr std::chrono::seconds kMostPatience{60};

/// Polls until `condition` holds; false when it does not in time.
template <typename Condition>
bool becomesTrue(Condition condition, std::chrono::milliseconds between = std::chrono::milliseconds(5)) {
  const auto deadline = std::chrono::steady_clock::now() + kMostPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(between);
  }
  return true;
}

struct ProgramOptions {
  /// "NAME=value", added to PATH and the options of the sanitizers; nothing else is inherited.
  std::vector<std::string> environment = {};
  /// The user and group to run it as, which takes root.
  std::optional<uid_t> user = {};
  /// Whoever read stderr is gone.
  bool stderr_broken = false;
  /// No file may grow beyond that, as on a full disk.
  std::optional<std::size_t> largest_file_bytes = {};
};

/// How a program ended.
struct Ending {
  bool exited = false;  ///< by itself, not by a signal
  int code = -1;        ///< exit status, or number of the signal
  bool operator==(const Ending&) const = default;
};
inline constexpr Ending exitedWith(int status) {
  return {true, status};
}
std::ostream& operator<<(std::ostream& stream, const Ending& ending);

/// A running program in a process group of its own; killed with the object, and when the test itself dies.
/// stdin is empty, what it prints is kept.
class Program {
 public:
  /// `command`: path of the program and its arguments.
  explicit Program(const std::vector<std::string>& command, const ProgramOptions& options = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  bool running();
  void signal(int number) const;
  /// Waits for its end. A program that does not end is killed, and the test fails.
  Ending wait();
  /// Whether a process of its group is left after its end.
  bool leftProcesses() const;

  /// What it has printed so far.
  std::string output() const;
  std::string errors() const;

 private:
  void reap(int options);

  pid_t pid_ = -1;
  int output_ = -1;
  int errors_ = -1;
  std::optional<Ending> ending_;
};

/// What a program that ran to its end has left.
struct Finished {
  Ending ending;
  std::string output;
  std::string errors;
};
Finished runToEnd(const std::vector<std::string>& command, const ProgramOptions& options = {});

}  // namespace hapticd::test
