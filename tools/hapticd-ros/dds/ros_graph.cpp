// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/ros_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/trace/ros/message_set.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::string_view kAnnouncement = "rmw_dds_common/ParticipantEntitiesInfo";
/// Announcements that wait to be read; one of each participant counts.
constexpr int kAnnouncementsKept = 1000;
/// Of readers, writers or participants that are looked at; in larger domains not all are shown.
constexpr std::size_t kMostSeen = 2048;

std::string idOf(const dds_guid_t& guid) {
  return {reinterpret_cast<const char*>(guid.v), sizeof guid.v};
}
std::string idOf(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  return idOf(guid);
}
trace::ros::Gid gidOf(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  return std::to_array(guid.v);
}
std::string idOf(const trace::ros::Gid& gid) {
  return {reinterpret_cast<const char*>(gid.data()), gid.size()};
}

std::string hexOf(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Qos qosOf(dds_entity_t entity) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  dds_get_qos(entity, qos.get());
  return qos;
}

std::string userDataOf(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return "";
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

std::string propertyOf(const dds_qos_t* qos, const char* name) {
  char* value = nullptr;
  if (!dds_qget_prop(qos, name, &value) || value == nullptr) return "";
  std::string text(value);
  dds_free(value);
  return base::printable(text);
}

/// What a participant tells of its process, as Cyclone DDS does; empty: nothing.
std::string programOf(const dds_qos_t* qos) {
  const std::string process = propertyOf(qos, "__ProcessName");
  if (process.empty()) return "";
  return fmt::format("{} (process {} of {})", process, propertyOf(qos, "__Pid"),
                     propertyOf(qos, "__Hostname"));
}

constexpr std::array kReliability{"best effort", "reliable"};
constexpr std::array kDurability{"volatile", "transient local", "transient", "persistent"};
constexpr std::array kLiveliness{"automatic", "manual by participant", "manual by topic"};
constexpr std::array kOwnership{"shared", "exclusive"};

std::string periodText(dds_duration_t duration_ns) {
  return duration_ns == DDS_INFINITY ? "none"
                                     : fmt::format("{:g} ms", static_cast<double>(duration_ns) * 1e-6);
}

/// Collects what does not match.
class Mismatches {
 public:
  /// A setting of which more is requested than is offered; `words`: of both.
  template <std::size_t kCount>
  void compare(const char* setting, std::size_t offered, std::size_t requested,
               const std::array<const char*, kCount>& words) {
    if (requested > offered && requested < kCount) add(setting, words[offered], words[requested]);
  }
  void add(const char* setting, const std::string& offered, const std::string& requested) {
    text_ += fmt::format("{}{}: {} is offered, {} is requested", text_.empty() ? "" : "; ", setting, offered,
                         requested);
  }
  std::string text() const { return text_; }

 private:
  std::string text_;
};

/// The readings of DDS for all participants, readers or writers that are there now.
template <typename Sample>
void forEachThere(const DdsEntity& builtin, auto take) {
  std::vector<void*> samples(kMostSeen, nullptr);
  std::vector<dds_sample_info_t> infos(kMostSeen);
  const dds_return_t count =
      dds_read_mask(builtin.get(), samples.data(), infos.data(), kMostSeen, kMostSeen,
                    DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE);
  for (std::size_t i = 0; std::cmp_less(i, count); ++i) {
    if (infos[i].valid_data) take(*static_cast<const Sample*>(samples[i]));
  }
  if (count > 0) dds_return_loan(builtin.get(), samples.data(), count);
}

}  // namespace

std::string mismatchOf(const dds_qos_t* offered, const dds_qos_t* requested) {
  Mismatches all;
  dds_reliability_kind_t reliability[2]{};
  dds_duration_t blocking = 0;
  dds_qget_reliability(offered, &reliability[0], &blocking);
  dds_qget_reliability(requested, &reliability[1], &blocking);
  all.compare("reliability", reliability[0], reliability[1], kReliability);
  dds_durability_kind_t durability[2]{};
  dds_qget_durability(offered, &durability[0]);
  dds_qget_durability(requested, &durability[1]);
  all.compare("durability", durability[0], durability[1], kDurability);
  dds_duration_t deadline_ns[2]{DDS_INFINITY, DDS_INFINITY};
  dds_qget_deadline(offered, &deadline_ns[0]);
  dds_qget_deadline(requested, &deadline_ns[1]);
  if (deadline_ns[1] < deadline_ns[0])
    all.add("deadline", periodText(deadline_ns[0]), periodText(deadline_ns[1]));
  dds_liveliness_kind_t liveliness[2]{};
  dds_duration_t lease_ns[2]{DDS_INFINITY, DDS_INFINITY};
  dds_qget_liveliness(offered, &liveliness[0], &lease_ns[0]);
  dds_qget_liveliness(requested, &liveliness[1], &lease_ns[1]);
  all.compare("liveliness", liveliness[0], liveliness[1], kLiveliness);
  if (lease_ns[1] < lease_ns[0])
    all.add("lease of liveliness", periodText(lease_ns[0]), periodText(lease_ns[1]));
  dds_ownership_kind_t ownership[2]{};
  dds_qget_ownership(offered, &ownership[0]);
  dds_qget_ownership(requested, &ownership[1]);
  if (ownership[0] != ownership[1])
    all.add("ownership", kOwnership[ownership[0] == DDS_OWNERSHIP_EXCLUSIVE],
            kOwnership[ownership[1] == DDS_OWNERSHIP_EXCLUSIVE]);
  return all.text();
}

base::Result<RosGraph> RosGraph::open(const Participant& participant) {
  auto announcement =
      Publisher::open(participant, kDiscoveryTopic, kAnnouncement, Publisher::Late::gets_last);
  if (!announcement) return std::unexpected(announcement.error());
  auto announcements =
      Subscription::open(participant, kDiscoveryTopic, kAnnouncement, kAnnouncementsKept, Delivery::last);
  if (!announcements) return std::unexpected(announcements.error());
  return RosGraph(participant, std::move(*announcement), std::move(*announcements));
}

RosGraph::RosGraph(const Participant& participant, Publisher announcement, Subscription announcements)
    : participant_(participant.get()),
      own_id_(idOf(participant.get())),
      announcement_(std::move(announcement)),
      announcements_(std::move(announcements)),
      readers_seen_(
          dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr)),
      writers_seen_(
          dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr)),
      participants_seen_(
          dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr)) {}

void RosGraph::announce(const std::string& name_space, const std::string& name,
                        std::span<const dds_entity_t> readers, std::span<const dds_entity_t> writers) {
  constexpr std::size_t kLongest = trace::ros::AnnouncedNode::kLongestName;
  const std::string full_name_space = ("/" + name_space).substr(0, kLongest);
  trace::ros::AnnouncedNode node{full_name_space, std::string_view(name).substr(0, kLongest), {}, {}};
  for (const dds_entity_t reader : readers) node.readers.push_back(gidOf(reader));
  for (const dds_entity_t writer : writers) node.writers.push_back(gidOf(writer));
  std::string message;
  trace::ros::encodeAnnouncement({gidOf(participant_), {std::move(node)}}, message);
  announcement_.write(std::move(message));
}

void RosGraph::update() {
  takeAnnouncements();
  readParticipants();
  readers_ = endpointsOf(readers_seen_);
  writers_ = endpointsOf(writers_seen_);
  std::erase_if(nodes_, [this](const auto& entry) { return !programs_.contains(entry.first); });
}

void RosGraph::takeAnnouncements() {
  announcements_.takeAll<trace::ros::Announcement>([this](const auto& announcement, const Origin&) {
    auto& nodes = nodes_[idOf(announcement.participant)];
    nodes.clear();
    for (const trace::ros::AnnouncedNode& node : announcement.nodes) {
      const std::string name = base::printable(
          fmt::format("{}{}{}", node.name_space, node.name_space.ends_with('/') ? "" : "/", node.name));
      for (const auto& gids : {node.readers, node.writers}) {
        for (const trace::ros::Gid& gid : gids) nodes[idOf(gid)] = name;
      }
    }
  });
}

void RosGraph::readParticipants() {
  programs_.clear();
  forEachThere<dds_builtintopic_participant_t>(participants_seen_, [this](const auto& sample) {
    programs_[idOf(sample.key)] = programOf(sample.qos);
  });
}

RosGraph::Endpoints RosGraph::endpointsOf(const DdsEntity& builtin) const {
  Endpoints all;
  forEachThere<dds_builtintopic_endpoint_t>(builtin, [&](const auto& sample) {
    if (idOf(sample.participant_key) == own_id_) return;
    std::shared_ptr<dds_qos_t> qos(dds_create_qos(), dds_delete_qos);
    dds_copy_qos(qos.get(), sample.qos);
    all.push_back({idOf(sample.key), idOf(sample.participant_key), sample.topic_name, sample.type_name,
                   userDataOf(sample.qos), std::move(qos)});
  });
  return all;
}

std::string RosGraph::nameOf(const Endpoint& endpoint) const {
  if (const auto nodes = nodes_.find(endpoint.participant); nodes != nodes_.end()) {
    const auto node = nodes->second.find(endpoint.id);
    if (node != nodes->second.end()) return node->second;
  }
  const auto program = programs_.find(endpoint.participant);
  if (program != programs_.end() && !program->second.empty()) return program->second;
  return "program " + hexOf(endpoint.participant);
}

Peer RosGraph::peerOf(const Endpoint& endpoint, dds_entity_t own, std::string problem) const {
  Peer peer{nameOf(endpoint), base::printable(endpoint.type), std::move(problem), ""};
  std::array<char, 256> own_type{};
  const dds_entity_t topic = dds_get_topic(own);
  dds_get_type_name(topic, own_type.data(), own_type.size());
  if (endpoint.type != own_type.data())
    peer.problem =
        fmt::format("its type is {}{}{}", peer.type, peer.problem.empty() ? "" : "; ", peer.problem);
  const std::string own_hash = userDataOf(qosOf(own).get());
  if (endpoint.user_data.contains("typehash=") && !endpoint.user_data.contains(own_hash))
    peer.warning = "its type has other fields or an older hash: " + base::printable(endpoint.user_data);
  return peer;
}

std::vector<Peer> RosGraph::readersOf(const Publisher& publisher) const {
  const std::string topic = ddsTopicName(publisher.topic());
  const Qos offered = qosOf(publisher.writer());
  std::vector<Peer> peers;
  for (const Endpoint& reader : readers_) {
    if (reader.topic == topic)
      peers.push_back(peerOf(reader, publisher.writer(), mismatchOf(offered.get(), reader.qos.get())));
  }
  return peers;
}

std::vector<std::string> RosGraph::otherWritersOf(const std::string& topic) const {
  const std::string dds_topic = ddsTopicName(topic);
  std::vector<std::string> names;
  for (const Endpoint& writer : writers_) {
    if (writer.topic == dds_topic) names.push_back(nameOf(writer));
  }
  return names;
}

std::vector<Peer> RosGraph::writersOf(const std::string& topic, dds_entity_t reader) const {
  const std::string dds_topic = ddsTopicName(topic);
  const Qos requested = qosOf(reader);
  std::vector<Peer> peers;
  for (const Endpoint& writer : writers_) {
    if (writer.topic == dds_topic)
      peers.push_back(peerOf(writer, reader, mismatchOf(writer.qos.get(), requested.get())));
  }
  return peers;
}

}  // namespace hapticd::tools::ros
