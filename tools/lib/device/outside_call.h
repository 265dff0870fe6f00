// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace hapticd::tools {

/// A call of a function of somebody else's, which may hang: as long as the object lives, another thread can
/// tell which one it is.  Thread: any.  Progress: wait-free.  RT: safe.
class OutsideCall {
 public:
  /// `name`: of the function; never freed.
  explicit OutsideCall(const char* name) noexcept;
  ~OutsideCall();
  OutsideCall(const OutsideCall&) = delete;
  OutsideCall& operator=(const OutsideCall&) = delete;

  struct Lasting {
    std::string_view name;
    std::int64_t since_ns = 0;  ///< CLOCK_MONOTONIC
  };
  /// The call that has lasted longest now, of those that have lasted for kPatienceNs.
  static std::optional<Lasting> hanging() noexcept;
  static constexpr std::int64_t kPatienceNs = 2'000'000'000;

 private:
  struct Place* place_ = nullptr;  // null: more calls at once than are watched
};

}  // namespace hapticd::tools
