// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/error.h"
#include "tools/hapticd-ros/dds/participant.h"

namespace hapticd::tools::ros {

/// A writer of one topic of ROS 2: reliable, without a key, in XCDR1, with the hash of its type. A subscriber
/// that does not keep up gets the newest messages. Copies are the same publisher.
/// Thread: one at a time; the counters from any.  RT: not safe: a write takes up to kMaxBlocking.
class Publisher {
 public:
  static constexpr std::chrono::milliseconds kMaxBlocking{20};

  /// What subscribers get that come after a message was written.
  enum class Late : std::uint8_t { gets_nothing, gets_last };

  /// `topic`: without the prefix of ROS 2, "MTMR/body/servo_cf". `message`: "geometry_msgs/WrenchStamped",
  /// whose structure is `type`; it outlives the publisher. `depth`: the number of messages that are kept
  /// until all subscribers have them.
  static base::Result<Publisher> open(const Participant& participant, const std::string& topic,
                                      std::string_view message, const dds_topic_descriptor_t& type, Late late,
                                      int depth = 1);

  /// Returns false where it could not be written; result() says why.
  bool write(const void* sample);
  /// Of the newest write, a code of Cyclone DDS.
  dds_return_t result() const noexcept { return result_; }
  /// The number of subscribers that are there now.
  int subscribers() const;
  /// Waits until all reliable subscribers have all that was written; false: not in time.
  bool isAcknowledged(std::chrono::nanoseconds at_most) const {
    return dds_wait_for_acks(writer_, at_most.count()) == DDS_RETCODE_OK;
  }

  const std::string& topic() const noexcept { return topic_; }
  std::string_view message() const noexcept { return message_; }
  dds_entity_t writer() const noexcept { return writer_; }
  std::uint64_t written() const noexcept { return counts_->written; }
  std::uint64_t failed() const noexcept { return counts_->failed; }

 private:
  struct Counts {
    std::atomic<std::uint64_t> written{0};
    std::atomic<std::uint64_t> failed{0};
  };

  Publisher(std::string topic, std::string_view message, dds_entity_t writer)
      : topic_(std::move(topic)), message_(message), writer_(writer) {}

  std::string topic_;
  std::string_view message_;
  dds_entity_t writer_;  // of the participant
  dds_return_t result_ = DDS_RETCODE_OK;
  std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();
};

}  // namespace hapticd::tools::ros
