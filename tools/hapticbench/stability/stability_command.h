// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace hapticd::tools {

/// `hapticbench stability`.
class StabilityCommand {
 public:
  /// Adds the subcommand to `app`, which the object must outlive together with.
  explicit StabilityCommand(CLI::App& app);
  StabilityCommand(const StabilityCommand&) = delete;
  StabilityCommand& operator=(const StabilityCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  CLI::App* command_;
  std::vector<std::string> laws_;
  std::vector<std::string> hands_;
  std::vector<std::string> devices_;
  std::vector<int> delays_ticks_;
  int region_delay_ticks_ = 1;
  std::string region_hand_ = "light";
  std::string region_file_;
  std::string plot_file_;
  std::string json_file_;
  bool shipped_ = false;
  bool quick_ = false;
};

}  // namespace hapticd::tools
