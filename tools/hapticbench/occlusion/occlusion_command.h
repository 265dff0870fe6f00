// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/hapticbench/occlusion/occlusion_study.h"

namespace hapticd::tools {

/// `hapticbench occlusion`.
class OcclusionCommand {
 public:
  /// Adds the subcommand to `app`, which outlives the object.
  explicit OcclusionCommand(CLI::App& app);
  OcclusionCommand(const OcclusionCommand&) = delete;
  OcclusionCommand& operator=(const OcclusionCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  OcclusionOptions options() const;

  CLI::App* command_;
  std::vector<std::string> parts_;
  std::vector<std::string> laws_;
  std::vector<double> distances_m_;
  std::vector<std::string> noises_;
  std::vector<std::string> hands_;
  std::vector<double> gaps_mm_;
  std::uint32_t seed_ = 1;
  bool quick_ = false;
  std::string json_file_;
};

}  // namespace hapticd::tools
