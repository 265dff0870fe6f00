#pragma once

#include <string>
#include <string_view>

namespace hapticd::tools {

/// A script that makes `shell` ("bash", "zsh" or "fish") complete hapticctl's commands, options, parameter
/// names and the values of choices. The names are those of the parameter table that this program was built
/// with; completing asks no daemon.
std::string completionScript(std::string_view shell);

}  // namespace hapticd::tools
