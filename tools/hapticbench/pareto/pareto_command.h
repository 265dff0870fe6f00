// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {

/// The subcommand `hapticbench pareto` with its options.
class ParetoCommand {
 public:
  /// Adds the subcommand to `app`, which outlives the object. `recordings`: the folder of recordings unless
  /// the option names another.
  ParetoCommand(CLI::App& app, const std::string& recordings);
  ParetoCommand(const ParetoCommand&) = delete;
  ParetoCommand& operator=(const ParetoCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// Measures, prints and writes what the options ask for. Returns the exit status.
  int run() const;

 private:
  int report(const ParetoResult& result, int cpu) const;

  CLI::App* command_;
  std::string recordings_;
  std::string json_file_;
  std::string plot_file_;
  std::string markdown_file_;
  std::string surface_table_file_;
  std::string laws_table_file_;
  int cpu_ = -1;
  bool quick_ = false;
};

}  // namespace hapticd::tools
