// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "config/base/error.h"
#include "config/settings/driver_rows.h"
#include "config/settings/parameter_table.h"
#include "config/settings/settings.h"
#include "rt/base/fields.h"

/// Rules between parameters; and changes of the live settings that give a person who holds the handle less
/// protection than he has.
namespace hapticd::config {

/// Returns every violated rule, or none.
std::vector<Conflict> conflictsIn(const Settings& settings);

/// Whether the change of one parameter loosens a limit, as its row says (Looser).
bool isLooser(const Parameter& parameter, const Value& before, const Value& after);

/// A limit that becomes looser, or a fixture or region that goes or becomes weaker.
struct Loosening {
  std::string name;  ///< "safety.max_force_n", "fixture nerve", "region liver"
  std::string text;  ///< "safety.max_force_n from 1 to 4 N", "fixture nerve is removed"

  friend bool operator==(const Loosening&, const Loosening&) = default;
};
template <std::same_as<Loosening> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{HAPTICD_FIELD(name, "The parameter, or \"fixture\" or \"region\" and its name"),
                    HAPTICD_FIELD(text, "What would change, for people")};
}

/// What a change of the live settings from `before` to `after` loosens: parameters in the order of the table,
/// then fixtures and regions. A forbidden region becomes weaker if it is disabled, if its stiffness, largest
/// force or clearance falls, if it begins to act later, or if its shape or place changes at all; guidance if
/// it is disabled.
std::vector<Loosening> looseningsOf(const Settings& before, const Settings& after);

/// `after` without what looseningsOf() lists; the caller must check the whole (checkTogether).
Settings withoutLoosening(const Settings& before, const Settings& after);

}  // namespace hapticd::config
