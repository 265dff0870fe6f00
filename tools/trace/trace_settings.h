// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/trace/trace_reader.h"

namespace hapticd::tools {

/// A parameter as a trace's settings have it.
struct TraceSetting {
  std::string name;   ///< "force.radius_m"
  std::string value;  ///< as it is written there
  bool text = false;  ///< stood in quotes, so that it is no number whatever it looks like
};

/// The file settings.yaml in the trace: the whole configuration at its begin, in the form of hapticd's own
/// file. Empty: the trace has none.
std::string_view settingsText(const drivers::TraceInfo& trace);

/// Its parameters, in its order; what is not of the form `group: {name: value}` is left out.
std::vector<TraceSetting> settingsIn(std::string_view text);

/// The value as a number, 1 and 0 for true and false; nothing where it is a text.
std::optional<double> numberIn(std::string_view value);

/// Period of the force loop by the settings, nanoseconds; nothing where they do not say.
std::optional<std::int64_t> periodIn(const drivers::TraceInfo& trace);

}  // namespace hapticd::tools
