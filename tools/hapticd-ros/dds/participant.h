// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "config/base/error.h"

namespace hapticd::tools::ros {

/// Where the participant is in the network.
struct Network {
  static constexpr int kLargestDomain = 232;  ///< whose ports fit below 65536

  int domain = 0;         ///< 0..232, as ROS_DOMAIN_ID
  std::string interface;  ///< name or address; empty: the loopback interface
  /// Of what is sent and taken; a larger message is dropped before it is put together.
  std::uint32_t largest_message_bytes = 1 << 20;
};

/// An entity of Cyclone DDS, deleted with what belongs to it.  Thread: one at a time.
class DdsEntity {
 public:
  explicit DdsEntity(dds_entity_t entity = 0) noexcept : entity_(entity) {}
  DdsEntity(DdsEntity&& other) noexcept : entity_(std::exchange(other.entity_, 0)) {}
  DdsEntity& operator=(DdsEntity&&) = delete;
  ~DdsEntity() {
    if (entity_ > 0) dds_delete(entity_);
  }
  dds_entity_t get() const noexcept { return entity_; }

 private:
  dds_entity_t entity_;
};

/// A program in a DDS domain, at one interface of this computer and at no other one: what arrives elsewhere,
/// wherever it says that it is from, does not reach its sockets. At another interface than loopback programs
/// of this computer reach them too. What Cyclone DDS has to say goes to standard error. CYCLONEDDS_URI is not
/// read: it could open other interfaces. Copies are the same participant, which ends with the last of them.
/// Thread: one at a time. Cyclone DDS starts threads of its own, which inherit the signal mask.
class Participant {
 public:
  /// Errors: an interface that does not exist or is down, sockets that cannot be bound to it, and what
  /// Cyclone DDS reports.
  static base::Result<Participant> join(const Network& network);

  dds_entity_t get() const noexcept { return joined_->participant.get(); }
  /// The name of the interface.
  const std::string& interface() const noexcept { return joined_->interface; }
  bool isLoopback() const noexcept { return joined_->is_loopback; }

 private:
  struct Joined {
    DdsEntity domain;
    DdsEntity participant;  // is deleted before the domain
    std::string interface;
    bool is_loopback;
  };
  explicit Participant(std::shared_ptr<const Joined> joined) : joined_(std::move(joined)) {}

  std::shared_ptr<const Joined> joined_;
};

}  // namespace hapticd::tools::ros
