// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace hapticd::tools {

/// `hapticbench sweep`.
class SweepCommand {
 public:
  /// Adds the subcommand to `app`. `recordings`: where they are looked for unless told otherwise.
  SweepCommand(CLI::App& app, const std::string& recordings);
  SweepCommand(const SweepCommand&) = delete;
  SweepCommand& operator=(const SweepCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  int merge() const;

  CLI::App* command_;
  std::string recordings_;
  std::string shard_ = "1/1";
  std::vector<std::string> merged_files_;
  std::string json_file_;
  int delay_ticks_ = 2;
  bool quick_ = false;
  bool filter_ = false;
};

}  // namespace hapticd::tools
