// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace hapticd::drivers {

using CpuSet = std::set<int>;

/// Parses a list of CPUs in the kernel's form ("0-2,5"; "" for none); nothing if the text does not have that
/// form or names a CPU above 65535.
std::optional<CpuSet> parseCpuList(std::string_view text);

/// Formats a list of CPUs in the kernel's form: "0-2,5".
std::string cpuListText(const CpuSet& cpus);

/// The CPUs that are in both lists.
CpuSet common(const CpuSet& a, const CpuSet& b);

}  // namespace hapticd::drivers
