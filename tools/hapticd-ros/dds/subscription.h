// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/error.h"
#include "daemon/trace/ros/message_set.h"
#include "tools/hapticd-ros/dds/cdr_topic.h"
#include "tools/hapticd-ros/dds/participant.h"

namespace hapticd::tools::ros {

/// Where a message comes from.
struct Origin {
  std::uint64_t publisher = 0;   ///< the same for all messages of one publisher; 0: none
  std::int64_t sent_utc_ns = 0;  ///< when it was written, by the clock of its computer
};

/// What a reader is to get.
enum class Delivery : std::uint8_t {
  newest,  ///< best effort, for what is soon replaced; matches publishers of either kind
  each,    ///< reliable, for what is sent once; matches reliable publishers, as ROS 2 makes them by default
  last,    ///< also what was written last before it came; matches only publishers that keep that
};

/// A reader of one topic of ROS 2, which neither hears nor counts the participant's own publishers.
/// Thread: one at a time.
class Subscription {
 public:
  /// `topic`: without the prefix of ROS 2, "hapticd/servo_cf". `message`: "geometry_msgs/WrenchStamped".
  /// `depth`: the number of messages that are kept until they are taken; the newest stay.
  static base::Result<Subscription> open(const Participant& participant, const std::string& topic,
                                         std::string_view message, int depth,
                                         Delivery delivery = Delivery::newest);

  /// Calls take(message, origin) for all messages that have come, oldest first; what is none of the type is
  /// left out. They are valid during the call.
  template <typename Message>
  void takeAll(auto take) {
    takeCdr(reader_, [&take](std::string_view bytes, const dds_sample_info_t& info) {
      if (const auto message = trace::ros::decode<Message>(bytes))
        take(*message, Origin{info.publication_handle, info.source_timestamp});
    });
  }

  /// The number of publishers that are there now.
  int publishers() const;
  dds_entity_t reader() const noexcept { return reader_; }

 private:
  explicit Subscription(dds_entity_t reader) : reader_(reader) {}

  dds_entity_t reader_;  // of the participant
};

/// Waits for messages of several subscriptions. `end` may be called by another thread.
class MessageWait {
 public:
  explicit MessageWait(const Participant& participant);

  void add(const Subscription& subscription);
  /// Returns when messages have come, at the end of the time, or when end() was called.
  void wait(std::chrono::nanoseconds at_most);
  /// Makes this and all later waits return at once.
  void end();
  bool ended() const;

 private:
  DdsEntity waitset_;
  DdsEntity ending_;
};

}  // namespace hapticd::tools::ros
