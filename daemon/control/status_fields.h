// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <span>
#include <string>
#include <vector>

#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// A choice of fields of the status, by dotted paths: "mode", "loop.rateHz".
class StatusFields {
 public:
  /// The whole status.
  StatusFields() = default;
  /// Errors: a reply io.hapticd.Status.UnknownField with the first path that is none.
  static std::expected<StatusFields, Reply> from(std::span<const std::string> paths);

  /// What is chosen of `status`, nested as there. A field of an object that is null is shown by that null.
  OrderedJson of(const OrderedJson& status) const;

 private:
  using Path = std::vector<std::string>;

  bool all_ = true;
  std::vector<Path> paths_;
};

}  // namespace hapticd::daemon
