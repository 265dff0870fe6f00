// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/disk_stall.h"

namespace hapticd::test {

/// How long a test waits for what must happen before it fails: a minute, which is sufficient for a loaded
/// machine under a sanitizer, or $HAPTICD_TEST_PATIENCE_S seconds (1 to 1000), for one that is emulated.
std::chrono::seconds maxPatience();

/// Polls until `condition` holds; returns false on timeout.
template <typename Condition>
bool becomesTrue(Condition condition, std::chrono::milliseconds between = std::chrono::milliseconds(5)) {
  const auto deadline = std::chrono::steady_clock::now() + maxPatience();
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(between);
  }
  return true;
}

/// How to run a Program.
struct ProgramOptions {
  /// "NAME=value", added to PATH, the options of the sanitizers and the patience of tests; nothing else is
  /// inherited.
  std::vector<std::string> environment = {};
  /// User and group to run as, which requires root.
  std::optional<uid_t> user = {};
  /// The reader of stderr is gone.
  bool stderr_broken = false;
  /// A descriptor for stderr, which stays the test's; errors() is empty then. -1: a file of its own.
  int stderr_to = -1;
  /// The disk below a folder that the test can stall; null: none. Where the kernel does not permit that, the
  /// program runs without.
  DiskStall* disk = nullptr;
  /// Largest size of a file, as on a full disk.
  std::optional<std::size_t> largest_file_bytes = {};
  /// Largest address space.
  std::optional<std::size_t> largest_memory_bytes = {};
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

/// A running program in a process group of its own; killed with the object and when the test itself dies.
/// stdin is empty; its output is kept.
class Program {
 public:
  /// `command`: path of the program and its arguments.
  explicit Program(const std::vector<std::string>& command, const ProgramOptions& options = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  /// Whether the disk of the options can be stalled.
  bool stallable() const { return stallable_; }
  bool running();
  void signal(int number) const;
  /// Waits for its end. A program that does not end is killed, and the test fails.
  Ending wait();
  /// Returns whether a process of its group is left after its end.
  bool leftProcesses() const;

  /// The most memory that was resident at a time, after its end. It is at least as much as this process had
  /// when it started the program.
  std::size_t peakMemoryBytes() const { return peak_memory_bytes_; }

  /// Returns its output so far.
  std::string output() const;
  std::string errors() const;

 private:
  void reap(int options);

  pid_t pid_ = -1;
  int output_ = -1;
  int errors_ = -1;
  bool stallable_ = false;
  std::optional<Ending> ending_;
  std::size_t peak_memory_bytes_ = 0;
};

/// The path of a program of a Debian package that is not installed for the tests: tools/install-dependencies
/// unpacks it below build/unpacked. Where the package is installed all the same, the installed one; empty
/// where neither is there.
std::string unpackedProgram(const std::string& name);

/// Result of a program that has ended.
struct Finished {
  Ending ending;
  std::string output;
  std::string errors;
};
Finished runToEnd(const std::vector<std::string>& command, const ProgramOptions& options = {});

/// Returns argv or envp for execve(); valid as long as `texts`.
inline std::vector<char*> execVector(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace hapticd::test
