// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::test {

/// A DDS domain that no other test has at the moment.
int ownDomain();
/// A namespace likewise.
std::string ownNamespace();

/// Reads plain CDR, little-endian, by hand: the encoding is in the first four bytes, and members are aligned
/// from the byte after them.
class CdrBytes {
 public:
  explicit CdrBytes(std::string bytes) : bytes_(std::move(bytes)), is_short_(bytes_.size() < 4) {}

  template <typename Number>
  Number number() {
    at_ += (sizeof(Number) - (at_ - 4) % sizeof(Number)) % sizeof(Number);
    Number value{};
    if (at_ + sizeof value <= bytes_.size()) std::memcpy(&value, bytes_.data() + at_, sizeof value);
    is_short_ = is_short_ || at_ + sizeof value > bytes_.size();
    at_ += sizeof value;
    return value;
  }
  std::string text();
  /// A list of bytes.
  std::string block();
  /// Whether all has been read, and nothing was missing. Up to three bytes may fill the last word, as the
  /// last byte of the encoding says.
  bool ended() const {
    return !is_short_ && at_ + (static_cast<unsigned char>(bytes_[3]) & 3U) == bytes_.size();
  }

 private:
  std::string bytes_;
  std::size_t at_ = 4;
  bool is_short_ = false;
};

/// Settings of Cyclone DDS for a program that looks for others as ROS 2 does with the discovery range
/// LOCALHOST: at the ports of the first participants of this computer, without multicast.
inline constexpr const char* kAsLocalhost =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer Address=\"localhost\"/></Peers>"
    "</Discovery></Domain></CycloneDDS>";

/// What discovery tells of a writer.
struct WriterSeen {
  std::string type = {};
  std::string user_data = {};
  std::string participant_user_data = {};
  bool reliable = false;
  bool transient_local = false;
  std::vector<int> representations = {};
};

/// A program of DDS with readers, which takes the bytes as they came.
class RosListener {
 public:
  explicit RosListener(int domain, const char* settings = kAsLocalhost);
  ~RosListener();
  RosListener(const RosListener&) = delete;
  RosListener& operator=(const RosListener&) = delete;

  /// `topic`: with "rt/". late: as a reader of tf_static, which gets what was written before it came.
  void subscribe(const std::string& topic, const dds_topic_descriptor_t& type, bool late = false);
  /// Whether a writer of the topic is matched.
  bool isMatched(const std::string& topic) const;
  /// The messages that have come since the last call, oldest first, with the bytes of the encoding in front.
  std::vector<std::string> take(const std::string& topic);
  /// What discovery tells of the writer of a topic; nothing: not seen yet.
  std::optional<WriterSeen> writerOf(const std::string& topic) const;

 private:
  std::string participantUserData(const dds_guid_t& key) const;

  dds_entity_t domain_;
  dds_entity_t participant_;
  dds_entity_t writers_seen_;
  dds_entity_t participants_seen_;
  std::map<std::string, dds_entity_t> readers_;
};

/// A program of DDS with writers, as ROS 2 makes them. Made after a RosListener of the same domain, whose
/// settings it shares.
class RosTalker {
 public:
  explicit RosTalker(int domain);
  ~RosTalker();
  RosTalker(const RosTalker&) = delete;
  RosTalker& operator=(const RosTalker&) = delete;

  /// Announces a topic, with "rt/".
  void advertise(const std::string& topic, const dds_topic_descriptor_t& type, bool reliable = true);
  /// Whether a reader of the topic is matched.
  bool isMatched(const std::string& topic) const;
  /// By which discovery tells the writer of a topic from all others.
  dds_guid_t guidOf(const std::string& topic) const;
  /// Announces a node with all writers, as RMWs of ROS 2 do.
  void announce(const std::string& name_space, const std::string& node);
  /// sample: of the type that was announced. `sent_utc_ns`: when it pretends to be written; nothing: now.
  void publish(const std::string& topic, const void* sample,
               std::optional<std::int64_t> sent_utc_ns = {}) const;

 private:
  dds_entity_t participant_;
  std::map<std::string, dds_entity_t> writers_;
};

/// Bytes as hexadecimal digits.
std::string hexOf(const std::string& bytes);

}  // namespace hapticd::test
