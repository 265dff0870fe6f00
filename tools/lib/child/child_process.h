// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"

namespace hapticd::tools {

/// How a program ended.
struct ChildEnding {
  bool exited = false;  ///< by itself, not by a signal
  int code = -1;        ///< exit status, or number of the signal

  bool good() const { return exited && code == 0; }
  /// "exit status 1", "signal 9".
  std::string text() const;
};

/// A running program in a process group of its own, with nothing to read. The group is killed with the
/// object, and the program also when the thread that started it ends. Thread: one at a time.
class ChildProcess {
 public:
  struct Options {
    int output = -1;                            ///< descriptor of its stdout, -1: nowhere
    int errors = -1;                            ///< descriptor of its stderr, -1: this process's
    std::vector<std::string> environment = {};  ///< "NAME=value", beside what this process has
  };

  /// `command`: the program, looked for in $PATH, and its arguments.
  /// Errors: it cannot be started; `remedy` ends the message.
  static base::Result<ChildProcess> start(const std::vector<std::string>& command, const Options& options,
                                          const std::string& remedy);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Returns how the program ended; nothing while it runs.
  std::optional<ChildEnding> ending();
  /// Waits for its end, at most `limit`.
  std::optional<ChildEnding> waitFor(std::chrono::milliseconds limit);

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}

  pid_t pid_;
  std::optional<ChildEnding> ending_;
};

/// While the object exists, Ctrl-C and SIGTERM do not end the process but are remembered, so that work in
/// steps can be finished properly. Only one object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Returns whether a signal has arrived.  Thread: any.
  bool requested() const noexcept;
};

}  // namespace hapticd::tools
