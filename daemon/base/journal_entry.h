// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/settings/event_kind.h"

namespace hapticd::daemon {

/// Names (upper case, digits, underscores; without the prefix HAPTICD_) and values, UTF-8.
using JournalFields = std::vector<std::pair<std::string_view, std::string>>;

/// One line of the daemon's log, with fields for programs to filter by.
struct JournalEntry {
  /// As in syslog(3).
  enum class Priority { error = 3, warning = 4, notice = 5, info = 6 };

  Priority priority = Priority::info;
  std::string text;                             ///< one line for people
  std::optional<config::EventKind> event = {};  ///< nothing: not an event, for the log only
  JournalFields fields = {};
};

}  // namespace hapticd::daemon
