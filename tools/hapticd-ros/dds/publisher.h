// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticd-ros/dds/cdr_topic.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::ros {

/// A writer of one topic of ROS 2: reliable, without a key, in XCDR1, with the hash of its type. A subscriber
/// that does not keep up gets the newest messages. Copies are the same publisher.
/// Thread: one at a time; the counters from any.  RT: not safe: a write takes up to kMaxBlocking.
class Publisher {
 public:
  static constexpr std::chrono::milliseconds kMaxBlocking{20};

  /// What subscribers get that come after a message was written.
  enum class Late : std::uint8_t { gets_nothing, gets_last };

  /// `topic`: without the prefix of ROS 2, "MTMR/body/servo_cf". `message`: "geometry_msgs/WrenchStamped"; it
  /// outlives the publisher. `depth`: the number of messages that are kept until all subscribers have them.
  static base::Result<Publisher> open(const Participant& participant, const std::string& topic,
                                      std::string_view message, Late late, int depth = 1);

  /// Takes a message in CDR. Returns false where it could not be written; result() says why.
  bool write(std::string message);
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

  Publisher(std::string topic, std::string_view message, const ddsi_sertype& type, dds_entity_t writer)
      : topic_(std::move(topic)), message_(message), type_(&type), writer_(writer) {}

  std::string topic_;
  std::string_view message_;
  const ddsi_sertype* type_;
  dds_entity_t writer_;  // of the participant, as the topic
  dds_return_t result_ = DDS_RETCODE_OK;
  std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();
};

/// Topics of one box. A message that cannot be written is counted; the first reason is kept.
/// Thread: one at a time.  RT: not safe, as Publisher.
class Publications {
 public:
  /// name_space: of the topics, "hapticd" or "left/hapticd".
  static base::Result<Publications> open(const Participant& participant, const std::string& name_space,
                                         std::span<const Topic> topics);

  /// Writes to one of the topics what encode(std::string& to) appends; returns whether it was written.
  template <typename Encode>
  bool publish(Topic topic, Encode encode) {
    std::string message;
    encode(message);
    return write(topic, std::move(message));
  }
  const Publisher& of(Topic topic) const { return *publishers_[static_cast<std::size_t>(topic)]; }

  /// The number of messages, those that could not be written without.
  std::uint64_t written() const noexcept;
  std::uint64_t failed() const noexcept;
  /// Why the first message since the last call could not be written; nothing: all could.
  std::optional<base::Error> takeProblem() { return std::exchange(problem_, std::nullopt); }
  /// In the order of Topic, valid as long as this object stays where it is.
  std::vector<const Publisher*> publishers() const;

 private:
  bool write(Topic topic, std::string message);

  std::array<std::optional<Publisher>, kTopicCount> publishers_;  // by topic
  std::optional<base::Error> problem_;
};

}  // namespace hapticd::tools::ros
