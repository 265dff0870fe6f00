// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/haptic-bridge/base/vendor_options.h"
#include "tools/haptic-bridge/inverse3/service_link.h"
#include "tools/haptic-bridge/inverse3/service_messages.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::inverse3 {

/// Haply's Inverse3 behind the Inverse Service of its vendor. The form in which a force is written follows
/// from the service's version; where the service ignores it, the other one is tried once, and none after
/// that.
class Inverse3Driver final : public DeviceDriver {
 public:
  /// `options.address`: empty: 127.0.0.1:10001. `options.device`: a device_id.
  explicit Inverse3Driver(const VendorOptions& options) : options_(options) {}

  base::Result<void> drive(DeviceSession& session) override;

 private:
  base::Result<void> driveOnce(DeviceSession& session);
  base::Result<KeyForm> formToUse(const ServiceVersion& version) const;

  VendorOptions options_;
  std::string version_;             ///< of the service for which these hold
  std::optional<KeyForm> ignored_;  ///< by the service
  bool both_ignored_ = false;
};

std::unique_ptr<DeviceDriver> makeInverse3Driver(const VendorOptions& options);

}  // namespace hapticd::tools::inverse3
