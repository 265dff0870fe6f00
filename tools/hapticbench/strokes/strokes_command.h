// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/hapticbench/strokes/strokes_study.h"

namespace hapticd::tools {

/// `hapticbench strokes`.
class StrokesCommand {
 public:
  /// Adds the subcommand to `app`, which the object must outlive together with.
  explicit StrokesCommand(CLI::App& app);
  StrokesCommand(const StrokesCommand&) = delete;
  StrokesCommand& operator=(const StrokesCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  StrokesOptions options() const;

  CLI::App* command_;
  std::vector<std::string> laws_;
  std::vector<std::string> scenes_;
  std::vector<double> distances_m_;
  std::vector<std::string> noises_;
  double depth_mm_ = 8;
  double latency_ms_ = 0;
  int repeats_ = 1;
  int count_ = 0;
  std::uint32_t seed_ = 1;
  bool quick_ = false;
  bool full_ = false;
  bool each_ = false;
  bool check_ = false;
  std::string json_file_;
};

}  // namespace hapticd::tools
