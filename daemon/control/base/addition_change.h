// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

/// One of the lists that people add to the scene.
enum class AdditionList { fixtures, regions };

/// What a call asks to change in a list, in this order.
struct AdditionChange {
  std::vector<Json> remove;  ///< names
  std::vector<Json> change;  ///< each an object with the name and the members to change
  std::vector<Json> add;     ///< each an object with the members of a definition
};

/// Returns the additions with one list changed.
/// Errors: all problems, also of elements of another type; `before` is not touched.
std::expected<config::SceneAdditions, std::vector<config::AdditionError>> changedAdditions(
    const config::SceneAdditions& before, AdditionList list, const AdditionChange& change);

/// The fixtures whose solid the box does not have, each as an error.
std::vector<config::AdditionError> missingSolids(const Box& box, const config::SceneAdditions& additions);

/// How a fixture or region differs from what it was.
struct AdditionDifference {
  config::EventKind kind{};  ///< frame, fixture or region
  std::string name;
  std::string action;  ///< add, change, enable, disable, remove
  /// Its definition before and after, or only the members that differ where it existed before and after, as
  /// JSON; cut where it is long.
  std::string old_value;
  std::string new_value;

  /// "changes fixture nerve from {...} to {...}"
  std::string text() const;
  JournalFields fields() const;
};

/// Returns what differs: first what was removed, then what was changed or added, in the order of `after`.
std::vector<AdditionDifference> differencesOf(const config::SceneAdditions& before,
                                              const config::SceneAdditions& after);

}  // namespace hapticd::daemon
