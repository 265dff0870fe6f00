// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/dds/subscription.h"

namespace hapticd::tools::ros {

/// A reader or writer of another program, on a topic of this one.
struct Peer {
  /// Its node, "/rviz2"; without one the name of the process, its number and its computer; else its id.
  std::string name;
  std::string type;     ///< in DDS, "geometry_msgs::msg::dds_::PoseStamped_"
  std::string problem;  ///< why no message passes; empty: messages pass
  std::string warning;  ///< what does not fit, though messages pass; empty: nothing
};

/// Why a writer and a reader do not match, for each setting "reliability: best effort is offered, reliable is
/// requested"; empty: they match.
std::string mismatchOf(const dds_qos_t* offered, const dds_qos_t* requested);

/// The programs in the domain, as discovery tells of them and as they tell themselves in ros_discovery_info;
/// there this program announces its node, too.
/// Thread: one at a time.  RT: not safe.
class RosGraph {
 public:
  static base::Result<RosGraph> open(const Participant& participant);

  /// Shows the node `name` in `name_space` ("hapticd") with these readers and writers, from now on.
  void announce(const std::string& name_space, const std::string& name, std::span<const dds_entity_t> readers,
                std::span<const dds_entity_t> writers);

  /// Reads what has been discovered.
  void update();
  /// Who reads what a publisher writes, as of the last update.
  std::vector<Peer> readersOf(const Publisher& publisher) const;
  /// Who writes what a subscription reads.
  std::vector<Peer> writersOf(const std::string& topic, dds_entity_t reader) const;
  /// The names of others that write to a topic.
  std::vector<std::string> otherWritersOf(const std::string& topic) const;

 private:
  struct Endpoint {
    std::string id;           // 16 bytes
    std::string participant;  // likewise
    std::string topic;        // in DDS
    std::string type;
    std::string user_data;
    std::shared_ptr<const dds_qos_t> qos;
  };
  using Endpoints = std::vector<Endpoint>;

  RosGraph(const Participant& participant, Publisher announcement, Subscription announcements);

  Endpoints endpointsOf(const DdsEntity& builtin) const;
  void takeAnnouncements();
  void readParticipants();
  std::string nameOf(const Endpoint& endpoint) const;
  Peer peerOf(const Endpoint& endpoint, dds_entity_t own, std::string problem) const;

  dds_entity_t participant_;
  std::string own_id_;
  Publisher announcement_;
  Subscription announcements_;
  DdsEntity readers_seen_;
  DdsEntity writers_seen_;
  DdsEntity participants_seen_;
  Endpoints readers_;
  Endpoints writers_;
  std::map<std::string, std::string> programs_;                      // by participant
  std::map<std::string, std::map<std::string, std::string>> nodes_;  // by participant and endpoint
};

}  // namespace hapticd::tools::ros
