// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/trace_reader.h"

namespace hapticd::tools {

/// A parameter in the settings of a trace.
struct TraceSetting {
  std::string name;   ///< "force.radius_m"
  std::string value;  ///< as it is written in the settings
  bool text = false;  ///< whether it is in quotes, so that it is a text even if it looks like a number
};

/// The file settings.yaml in the trace: the whole configuration at its beginning, in the form of hapticd's
/// own file. Empty if the trace has none.
std::string_view settingsText(const drivers::TraceInfo& trace);

/// The parameters in such a file, in its order; what does not have the form `group: {name: value}` is left
/// out.
std::vector<TraceSetting> settingsIn(std::string_view text);

/// The value as a number, with 1 and 0 for true and false; nothing if it is a text.
std::optional<double> numberIn(std::string_view value);

/// The period of the force loop in the settings, in nanoseconds; nothing if they do not contain it.
std::optional<std::int64_t> periodIn(const drivers::TraceInfo& trace);

}  // namespace hapticd::tools
