// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/force_law.h"
#include "rt/loop_state.h"

namespace hapticd::tools {

/// The unit that the end of a field's name says, "" for none: "N" for command_force_n_in_world.
std::string_view unitOf(std::string_view field);

/// Whether a field of a record says something. In ticks of a law without a proxy `contact` and
/// `proxy_m_in_world` do not.
bool applies(const rt::Tick& tick, std::string_view field);
inline bool applies(const auto&, std::string_view) {
  return true;
}
/// Whether that is a field of ticks that laws without a proxy do not have.
bool needsProxy(std::string_view field);

/// The field of directives whose names and values are columns of their own.
inline constexpr std::string_view kParameters = "parameters";

/// A text as a field of CSV (RFC 4180).
std::string inCsvQuotes(std::string_view text);

/// Names and values in one line: "name=value; name=value".
std::string joined(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace hapticd::tools
