// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/haptic-soak/daemon_process.h"
#include "tools/haptic-soak/process_sample.h"
#include "tools/haptic-soak/soak_clients.h"
#include "tools/lib/child/interrupt.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

struct SoakOptions {
  std::filesystem::path daemon;  ///< hapticd
  std::filesystem::path hapticctl;
  std::filesystem::path config_file;
  std::vector<std::string> assignments;  ///< "NAME=VALUE", over the file
  double seconds = 600;
  std::uint64_t seed = 1;
  std::string
      on_replug;  ///< command for the shell that unplugs and plugs devices, with $HAPTICD_PID; empty: none
  double replug_every_s = 5;
};

/// The observations of a soak.
struct SoakResult {
  std::vector<ProcessSample> samples;  ///< over the time, clients at work
  ProcessSample before;                ///< no client connected, before the first
  ProcessSample after;                 ///< no client connected, after the last
  Json status;                         ///< GetStatus at the end
  std::vector<ClientTally> clients;
  std::uint64_t reloads = 0;
  std::uint64_t replugs = 0;
  std::uint64_t failed_replugs = 0;         ///< the command did not end with 0
  bool interrupted = false;                 ///< ended early by Ctrl-C
  std::optional<ChildEnding> early_ending;  ///< hapticd ended by itself
  std::optional<ChildEnding> ending;        ///< after SIGTERM
  std::string last_words;                   ///< of hapticd, when it ended badly
  std::string status_error;                 ///< why there is no `status`
};

/// Runs the daemon and everything around it. `progress` is given the time, s.
/// Errors: hapticd does not start.
config::Result<SoakResult> runSoak(const SoakOptions& options, const Interrupt& interrupt,
                                   const std::function<void(double)>& progress);

}  // namespace hapticd::tools
