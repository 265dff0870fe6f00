// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "config/base/error.h"
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
  /// `topic`: without the prefix of ROS 2, "hapticd/servo_cf". `message`: "geometry_msgs/WrenchStamped",
  /// whose structure is `type`. `depth`: the number of messages that are kept until they are taken; the
  /// newest stay.
  static base::Result<Subscription> open(const Participant& participant, const std::string& topic,
                                         std::string_view message, const dds_topic_descriptor_t& type,
                                         int depth, Delivery delivery = Delivery::newest);

  /// Calls take(message, origin) for all messages that have come, oldest first. They are valid during the
  /// call; their texts are never null.
  template <typename Message>
  void takeAll(auto take) {
    constexpr std::size_t kAtOnce = 16;
    std::array<dds_sample_info_t, kAtOnce> infos{};
    for (;;) {
      std::array<void*, kAtOnce> samples{};  // null: of DDS
      const dds_return_t count = dds_take(reader_, samples.data(), infos.data(), kAtOnce, kAtOnce);
      if (count <= 0) return;
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        if (infos[i].valid_data)
          take(*static_cast<const Message*>(samples[i]),
               Origin{infos[i].publication_handle, infos[i].source_timestamp});
      }
      dds_return_loan(reader_, samples.data(), count);
    }
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
