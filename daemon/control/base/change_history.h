// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "config/settings/settings.h"
#include "daemon/base/journal_entry.h"

namespace hapticd::daemon {

/// A live parameter whose value changes.
struct ParameterDifference {
  std::string name;
  std::string old_value;
  std::string new_value;

  /// "sets force.radius_m from 0.02 to 0.03"
  std::string text() const;
  /// Of a log entry: the parameter, its old and its new value.
  JournalFields fields() const;
};

/// Returns the live parameters whose values differ, in the order of the table.
std::vector<ParameterDifference> parameterDifferences(const config::Settings& before,
                                                      const config::Settings& after);

/// Returns a sentence for each live parameter, fixture and region that differs.
std::vector<std::string> textsOfDifferences(const config::Settings& before, const config::Settings& after);

/// Remembers the last changes of live parameters, fixtures and regions that clients have made, so that they
/// can be undone from the last one on.
///
/// What is remembered holds only while nobody else has changed the settings, such as a reload of the
/// configuration: then it would restore a mixture that nobody has ever seen, and is forgotten. A stiffness
/// that estimators have measured for a region does not count as a change. Thread: control thread only.
class ChangeHistory {
 public:
  static constexpr std::size_t kMaxChanges = 16;  ///< older ones are forgotten

  /// A client has changed the settings. Nothing is remembered where they do not differ.
  void record(const config::Settings& before, const config::Settings& after);

  /// Returns `now` without the last change; nothing if there is none, or none that still holds.
  std::optional<config::Settings> undone(const config::Settings& now) const;

  /// Whether changes were made that no longer hold, because something else has changed the settings since.
  bool isOutdated(const config::Settings& now) const;

  /// The last change has been undone.
  void dropLast() { changes_.pop_back(); }

  std::size_t size() const noexcept { return changes_.size(); }

 private:
  struct Recorded {
    config::Settings before;
    config::Settings after;
  };

  std::deque<Recorded> changes_;  // the last one is the newest
};

}  // namespace hapticd::daemon
