// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace hapticd::daemon {

/// The last CPU that the kernel keeps free of other tasks (isolcpus=), or -1 when there is none.
/// `file`: a list of CPUs as the kernel writes it ("2-3,5").
int lastIsolatedCpu(const std::filesystem::path& file = "/sys/devices/system/cpu/isolated");

/// Whether `file`, a list of CPUs as above, names `cpu`.
bool isIsolated(int cpu, const std::filesystem::path& file = "/sys/devices/system/cpu/isolated");

}  // namespace hapticd::daemon
