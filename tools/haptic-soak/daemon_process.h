// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {

/// A new folder that is removed with the object; its path is empty if it could not be created.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The content of the configuration file for a reload.
enum class ReloadKind { same, damaged, wrong_name };

/// hapticd, started on sockets in a folder of its own.
/// Thread: one at a time.
class DaemonProcess {
 public:
  /// `program`: hapticd; `config_file`: copied; `assignments`: further `NAME=VALUE`.
  /// Errors: a file cannot be read, hapticd does not answer within 30 s or ends (with its last output).
  static config::Result<DaemonProcess> start(const ScratchFolder& folder,
                                             const std::filesystem::path& program,
                                             const std::filesystem::path& config_file,
                                             const std::vector<std::string>& assignments);

  pid_t pid() const { return child_.pid(); }
  std::string statusSocket() const { return (folder_ / "Status").string(); }
  std::string controlSocket() const { return (folder_ / "Control").string(); }
  bool running() { return !child_.ending(); }
  /// Rewrites the configuration file and sends SIGHUP.
  void reload(ReloadKind kind);
  /// SIGTERM, and how it ended; nothing when it does not within 30 s.
  std::optional<ChildEnding> stop();
  /// The end of its output.
  std::string lastWords() const;

 private:
  DaemonProcess(ChildProcess child, std::filesystem::path folder, std::string configuration)
      : child_(std::move(child)), folder_(std::move(folder)), configuration_(std::move(configuration)) {}

  config::Result<void> waitUntilItAnswers();

  ChildProcess child_;
  std::filesystem::path folder_;
  std::string configuration_;
};

}  // namespace hapticd::tools
