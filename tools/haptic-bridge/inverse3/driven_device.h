// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "drivers/handle/udp/peer_clock.h"
#include "tools/haptic-bridge/inverse3/echo_check.h"
#include "tools/haptic-bridge/inverse3/safety_watch.h"
#include "tools/haptic-bridge/inverse3/service_link.h"
#include "tools/haptic-bridge/inverse3/service_messages.h"
#include "tools/lib/device/device_session.h"

namespace hapticd::tools::inverse3 {

/// Most force of a device of that type, N.
double forceLimitOf(const std::string& type);
/// The delay of the service's force gate, if it is a filter of first order per millisecond, which nobody has
/// measured; 0: it says nothing about it.
std::int64_t gateDelayEstimateNs(const ServiceFilters& filters);

/// One device of the service, from the first frame with zero force to the last one. Thread: one.
class DrivenDevice {
 public:
  static constexpr std::int64_t kTickNs = 1'000'000;

  /// `events`: nothing: the service has no event channel. All references outlive this.
  DrivenDevice(DeviceSession& session, ServiceLink& link, std::optional<ServiceLink>& events,
               const InventoryEntry& entry, KeyForm form);
  /// Sends zero force and a clear, and closes the link.
  ~DrivenDevice();
  DrivenDevice(const DrivenDevice&) = delete;
  DrivenDevice& operator=(const DrivenDevice&) = delete;

  /// Commands zero until the service has shown that it exerts nothing.  Errors: it exerts something, or the
  /// device was lost.
  base::Result<void> begin();
  /// Drives the device until the session ends.  Errors: why it cannot be used any longer.
  base::Result<void> run();
  /// Whether the service has ignored all forces in this form.
  bool ignoresForces() const { return check_.verdict() == EchoCheck::Verdict::ignored && !was_proven_; }

 private:
  struct Sent {
    std::int64_t time_ns = 0;
    rt::Vec3 force_n;
  };

  template <typename Done>
  base::Result<void> tickUntil(Done done);
  base::Result<void> tick(std::int64_t now_ns);
  base::Result<void> hearEvents();
  rt::Vec3 forceAt(std::int64_t now_ns);
  base::Result<void> send(const rt::Vec3& force_n, std::int64_t now_ns);
  base::Result<void> hearAnswer();
  base::Result<void> take(const std::string& text);
  base::Result<void> takeUseless(StateFault fault);
  bool isPossible(const DeviceState& state) const;
  base::Result<void> judgeEcho() const;
  void publish(const DeviceState& state, std::int64_t measured_ns);
  void rememberGrip(const DeviceState& state, std::int64_t now_ns);
  base::Result<void> report(const Finding& finding);
  void leave();

  DeviceSession& session_;
  ServiceLink& link_;
  std::optional<ServiceLink>& events_;
  InventoryEntry entry_;
  KeyForm form_;
  FrameWriter writer_;
  double limit_n_;
  SafetyWatch watch_;
  EchoCheck check_;
  bool was_proven_ = false;
  drivers::udp::DelayEstimate round_trip_;
  std::deque<Sent> sent_;  // without an answer yet
  rt::Vec3 echoed_n_;
  bool said_slow_ = false;
  int useless_in_a_row_ = 0;
  std::uint64_t useless_ = 0;
  std::uint64_t unasked_ = 0;
  std::optional<rt::Vec3> place_m_;  // of the last state
  std::optional<rt::Quaternion> orientation_;
  std::uint32_t buttons_ = 0;
  std::int64_t grip_changed_ns_ = 0;
  bool grip_old_ = true;
};

}  // namespace hapticd::tools::inverse3
