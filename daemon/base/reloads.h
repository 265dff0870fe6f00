// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "config/conflicts.h"
#include "daemon/status/box_status.h"

namespace hapticd::daemon {

/// What a reload or its confirmation has done.
struct ReloadReport {
  std::uint64_t generation = 0;      ///< that the force loop has to take over
  std::vector<std::string> changes;  ///< a sentence each
  std::vector<std::string> waiting;  ///< names of parameters that take effect at the next start
  std::vector<std::string> hidden;   ///< as in Reload
};

/// Reloads of the configuration, as the control API requests them.
/// Thread: control thread only.
class Reloads {
 public:
  using Outcome = std::expected<ReloadReport, std::vector<base::Error>>;

  virtual ~Reloads() = default;
  /// Requests that the configuration file is read again, and returns the number of the reload that does.
  virtual std::uint64_t request() = 0;
  /// The outcome of that reload or a later one; nothing until it has ended.
  virtual std::optional<Outcome> outcome(std::uint64_t number) const = 0;
  /// What waits for confirmation; nothing: nothing does.
  virtual const std::optional<PendingReload>& pending() const = 0;
  /// Applies what waits.  Errors: it contradicts what has changed since.
  virtual Outcome confirm() = 0;
};

}  // namespace hapticd::daemon
