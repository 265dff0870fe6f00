// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <span>
#include <string>
#include <vector>

#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// A selection of fields of the status by their paths, such as "mode" and "loop.rateHz".
class StatusFields {
 public:
  /// Selects the whole status.
  StatusFields() = default;
  /// Errors: a reply io.hapticd.Status.UnknownField with the first unknown path.
  static std::expected<StatusFields, Reply> from(std::span<const std::string> paths);

  /// The selected fields of `status`, nested as there. If an object is null, its fields are shown by that
  /// null.
  OrderedJson of(const OrderedJson& status) const;

 private:
  using Path = std::vector<std::string>;

  bool all_ = true;
  std::vector<Path> paths_;
};

}  // namespace hapticd::daemon
