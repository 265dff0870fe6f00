// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <expected>
#include <filesystem>
#include <memory>
#include <string_view>

#include "config/base/descriptor.h"
#include "config/base/file_content.h"

namespace hapticd::base {

/// Bytes that nobody changes, with what keeps them in memory. kReadableBehind more may be read behind them;
/// what those are is not defined. They begin where a number of any type may be.
using HeldBytes = std::shared_ptr<const std::string_view>;
inline constexpr std::size_t kReadableBehind = 8;

/// A copy of `bytes`.
HeldBytes heldCopy(std::string_view bytes);

/// Large data is written, copied and mapped in parts of at most so much. A kernel that is not built for real
/// time gives a write of megabytes pages as large and does not leave their CPU to anybody until each is
/// filled, for several milliseconds. While locked memory is being mapped, no other thread of the process can
/// map any.
inline constexpr std::size_t kBytesAtOnce = 64 * 1024;

/// Maps the memory file of another process in parts, without a copy. Null: it is not sealed against writing,
/// shrinking and growing, is empty or longer than `longest`, or there is no memory for it.
/// Thread: any; the last holder unmaps it.
HeldBytes mappedMemory(const Descriptor& memory, std::size_t longest);

/// A file in memory that is mapped in parts.
/// Thread: any.  Progress: blocking on the disk.
/// Errors: as fileContent(), and where there is no memory.
std::expected<HeldBytes, FileFault> mappedCopy(const std::filesystem::path& file, const FileRequest& request);

}  // namespace hapticd::base
