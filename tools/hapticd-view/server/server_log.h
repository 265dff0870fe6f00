// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace hapticd::tools::view {

/// Lines on standard error, which systemd takes into the journal. Refusals are limited, so that nobody fills
/// the disk by being refused. Thread: the io_context's.
class ServerLog {
 public:
  static constexpr int kMostAtOnce = 20;    ///< refusals in a row
  static constexpr int kMostPerSecond = 1;  ///< on average after that

  /// A line, whatever came before.
  void write(const std::string& line);
  /// A line about a refusal, unless there were too many; those left out are counted in a later one.
  void refuse(const std::string& who, const std::string& reason);

 private:
  std::chrono::steady_clock::time_point refilled_{};
  double allowed_ = kMostAtOnce;
  std::uint64_t left_out_ = 0;
};

}  // namespace hapticd::tools::view
