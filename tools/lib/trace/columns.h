// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/force_law.h"
#include "rt/loop_state.h"

namespace hapticd::tools {

/// Whether a field of a record has a meaning. In ticks of a law without a proxy `contact` and
/// `proxy_m_in_world` have none.
bool applies(const rt::Tick& tick, std::string_view field);
inline bool applies(const auto&, std::string_view) {
  return true;
}
/// Whether laws without a proxy lack that field of ticks.
bool needsProxy(std::string_view field);

/// The field of directives whose names and values become columns of their own.
inline constexpr std::string_view kParameters = "parameters";

/// Quotes a text as a field of CSV (RFC 4180).
std::string inCsvQuotes(std::string_view text);

/// Joins names and values in one line: "name=value; name=value".
std::string joined(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace hapticd::tools
