#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hapticd::tools {

/// The unit that the end of a field's name says, "" for none: "N" for command_force_n_in_world.
std::string_view unitOf(std::string_view field);

/// Names and values in one line: "name=value; name=value".
std::string joined(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace hapticd::tools
