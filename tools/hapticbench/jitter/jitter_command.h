// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/hapticbench/jitter/jitter_study.h"

namespace hapticd::tools {

/// `hapticbench jitter`.
class JitterCommand {
 public:
  /// Adds the subcommand to `app`, which the object must outlive together with.
  explicit JitterCommand(CLI::App& app);
  JitterCommand(const JitterCommand&) = delete;
  JitterCommand& operator=(const JitterCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  CLI::App* command_;
  JitterOptions options_;
  std::string plot_file_;
  std::string json_file_;
};

}  // namespace hapticd::tools
