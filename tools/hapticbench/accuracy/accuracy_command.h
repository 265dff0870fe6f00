// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {

/// `hapticbench accuracy`.
class AccuracyCommand {
 public:
  /// Adds the subcommand to `app`, which outlives the object.
  explicit AccuracyCommand(CLI::App& app);
  AccuracyCommand(const AccuracyCommand&) = delete;
  AccuracyCommand& operator=(const AccuracyCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  AccuracyOptions options() const;

  CLI::App* command_;
  std::vector<std::string> scenes_;
  std::vector<std::string> laws_;
  std::vector<double> distances_m_;
  std::vector<std::string> noises_;
  std::vector<double> voxel_edges_mm_;
  std::vector<std::string> filters_;
  std::uint32_t seed_ = 1;
  bool quick_ = false;
  bool full_ = false;
  std::string json_file_;
};

}  // namespace hapticd::tools
