// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/error.h"
#include "tools/hapticd-ros/dds/participant.h"

namespace hapticd::tools::ros {

/// A writer of one topic of ROS 2, reliable, of which only the newest message counts: an older one that has
/// not arrived yet is not sent any more.
/// Thread: one at a time.  RT: not safe: a write takes up to kMaxBlocking.
class Publisher {
 public:
  static constexpr std::chrono::milliseconds kMaxBlocking{20};

  /// What subscribers get that come after a message was written.
  enum class Late : std::uint8_t { gets_nothing, gets_last };

  /// `topic`: without the prefix of ROS 2, "MTMR/body/servo_cf". `message`: "geometry_msgs/WrenchStamped",
  /// whose structure is `type`.
  static base::Result<Publisher> open(const Participant& participant, const std::string& topic,
                                      std::string_view message, const dds_topic_descriptor_t& type,
                                      Late late);

  /// As open() was told.
  const std::string& topic() const noexcept { return topic_; }
  const std::string& message() const noexcept { return message_; }
  /// The entity in DDS, valid as long as the participant.
  dds_entity_t writer() const noexcept { return writer_; }

  /// Returns false where it could not be written.
  bool write(const void* sample) { return dds_write(writer_, sample) == DDS_RETCODE_OK; }
  /// The number of subscribers that are there now.
  int subscribers() const;
  /// Waits until all reliable subscribers have all that was written; false: not in time.
  bool isAcknowledged(std::chrono::nanoseconds at_most) const {
    return dds_wait_for_acks(writer_, at_most.count()) == DDS_RETCODE_OK;
  }

 private:
  Publisher(dds_entity_t writer, std::string topic, std::string message)
      : writer_(writer), topic_(std::move(topic)), message_(std::move(message)) {}

  dds_entity_t writer_;  // of the participant
  std::string topic_;
  std::string message_;
};

}  // namespace hapticd::tools::ros
