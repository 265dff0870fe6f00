// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace hapticd::tools {

/// `hapticbench noise`.
class NoiseCommand {
 public:
  /// Adds the subcommand to `app`, which the object must outlive together with.
  explicit NoiseCommand(CLI::App& app);
  NoiseCommand(const NoiseCommand&) = delete;
  NoiseCommand& operator=(const NoiseCommand&) = delete;

  bool chosen() const { return command_->parsed(); }
  /// The exit status.
  int run() const;

 private:
  CLI::App* command_;
  std::string recording_;
  std::string made_up_;
  std::vector<int> windows_px_;
  int first_frame_ = 0;
  int frames_ = 60;
  std::uint32_t seed_ = 1;
  std::string json_file_;
};

}  // namespace hapticd::tools
