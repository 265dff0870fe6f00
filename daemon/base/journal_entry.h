// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/settings/event_kind.h"
#include "rt/base/words.h"

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

/// The word of an enumerator ("engaged", "depth_stale"), as the control interface and the journal write it.
template <rt::Worded Enumeration>
const char* nameOf(Enumeration value) {
  return rt::wordOf(value).data();  // a string literal
}

}  // namespace hapticd::daemon
