// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/hapticbench/recordings/recordings_study.h"

namespace hapticd::tools {

/// `hapticbench recordings`.
class RecordingsCommand {
 public:
  /// Adds the subcommand to `app`, which outlives the object.
  RecordingsCommand(CLI::App& app, const std::string& recordings);
  RecordingsCommand(const RecordingsCommand&) = delete;
  RecordingsCommand& operator=(const RecordingsCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  RecordingsOptions options() const;

  CLI::App* command_;
  std::vector<std::string> laws_;
  std::vector<double> sizes_mm_;
  std::string recordings_;
  int most_frames_ = 300;
  bool quick_ = false;
  std::string json_file_;
};

}  // namespace hapticd::tools
