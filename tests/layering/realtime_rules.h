// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace hapticd::test {

/// Returns each construct in the C++ files of `folder` that the real-time core must not use, as
/// "file:line: what": headers of containers, strings, streams and locks; exceptions; allocations except in
/// the initialisers of a constructor. The files named in `start_up_only` run before the loop and may allocate
/// anywhere.
std::vector<std::string> wrongInRealtimeCode(const std::filesystem::path& folder,
                                             const std::set<std::string>& start_up_only = {});

}  // namespace hapticd::test
