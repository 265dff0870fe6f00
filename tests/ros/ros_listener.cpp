// SPDX-License-Identifier: Apache-2.0
#include "tests/ros/ros_listener.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "ros_messages.h"

namespace hapticd::test {
namespace {

std::string userDataOf(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return "";
  const std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

WriterSeen seenOf(const dds_builtintopic_endpoint_t& endpoint) {
  WriterSeen seen{.type = endpoint.type_name, .user_data = userDataOf(endpoint.qos)};
  dds_reliability_kind_t reliability{};
  dds_duration_t blocking = 0;
  seen.reliable =
      dds_qget_reliability(endpoint.qos, &reliability, &blocking) && reliability == DDS_RELIABILITY_RELIABLE;
  dds_durability_kind_t durability{};
  seen.transient_local =
      dds_qget_durability(endpoint.qos, &durability) && durability == DDS_DURABILITY_TRANSIENT_LOCAL;
  std::uint32_t count = 0;
  dds_data_representation_id_t* all = nullptr;
  if (dds_qget_data_representation(endpoint.qos, &count, &all)) {
    seen.representations.assign(all, all + count);
    dds_free(all);
  }
  return seen;
}

/// Calls visit(sample) for all that a reader of a built-in topic knows.
template <typename Sample>
void forEachSeen(dds_entity_t reader, auto visit) {
  constexpr std::size_t kMost = 1000;
  std::vector<void*> samples(kMost);
  std::vector<dds_sample_info_t> infos(kMost);
  const dds_return_t count = dds_read(reader, samples.data(), infos.data(), kMost, kMost);
  for (std::size_t i = 0; count > 0 && i < static_cast<std::size_t>(count); ++i) {
    if (infos[i].valid_data && infos[i].instance_state == DDS_ALIVE_INSTANCE_STATE)
      visit(*static_cast<const Sample*>(samples[i]));
  }
  if (count > 0) dds_return_loan(reader, samples.data(), count);
}

}  // namespace

int ownDomain() {
  // From domain 101 on, Linux may have given one of their ports, 7400 + 250 * domain and more, to any other
  // socket.
  return 20 + ::getpid() % 80;
}

std::string ownNamespace() {
  return fmt::format("test_{}/box", ::getpid());
}

std::string CdrBytes::text() {
  const auto size = number<std::uint32_t>();  // with the NUL
  if (size == 0 || size > bytes_.size() - std::min(at_, bytes_.size())) {
    is_short_ = true;
    return "";
  }
  const std::string text = bytes_.substr(at_, size - 1);
  at_ += size;
  return text;
}

std::string CdrBytes::block() {
  const auto size = number<std::uint32_t>();
  if (at_ > bytes_.size() || size > bytes_.size() - at_) {
    is_short_ = true;
    return "";
  }
  at_ += size;
  return bytes_.substr(at_ - size, size);
}

RosListener::RosListener(int domain, const char* settings)
    // fails where the test publishes in the same process, so that the domain is there already
    : domain_(dds_create_domain(static_cast<dds_domainid_t>(domain), settings)),
      participant_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)),
      writers_seen_(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr)),
      participants_seen_(
          dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr)) {
  EXPECT_GT(participant_, 0) << dds_strretcode(-participant_);
}

RosListener::~RosListener() {
  dds_delete(participant_);
  if (domain_ > 0) dds_delete(domain_);
}

void RosListener::subscribe(const std::string& topic, const dds_topic_descriptor_t& type, bool late) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10'000);
  dds_qset_durability(qos, late ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  const dds_entity_t entity = dds_create_topic(participant_, &type, topic.c_str(), nullptr, nullptr);
  const dds_entity_t reader = dds_create_reader(participant_, entity, qos, nullptr);
  EXPECT_GT(reader, 0) << topic << ": " << dds_strretcode(-reader);
  dds_delete_qos(qos);
  readers_[topic] = reader;
}

bool RosListener::isMatched(const std::string& topic) const {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(readers_.at(topic), &status) == DDS_RETCODE_OK &&
         status.current_count > 0;
}

std::vector<std::string> RosListener::take(const std::string& topic) {
  constexpr std::size_t kMost = 10'000;
  std::vector<ddsi_serdata*> samples(kMost);
  std::vector<dds_sample_info_t> infos(kMost);
  const dds_return_t count =
      dds_takecdr(readers_.at(topic), samples.data(), kMost, infos.data(), DDS_ANY_STATE);
  std::vector<std::string> messages;
  for (std::size_t i = 0; count > 0 && i < static_cast<std::size_t>(count); ++i) {
    if (infos[i].valid_data) {
      std::string bytes(ddsi_serdata_size(samples[i]), '\0');
      ddsi_serdata_to_ser(samples[i], 0, bytes.size(), bytes.data());
      messages.push_back(std::move(bytes));
    }
    ddsi_serdata_unref(samples[i]);
  }
  return messages;
}

std::optional<WriterSeen> RosListener::writerOf(const std::string& topic) const {
  std::optional<WriterSeen> seen;
  forEachSeen<dds_builtintopic_endpoint_t>(writers_seen_, [&](const dds_builtintopic_endpoint_t& endpoint) {
    if (endpoint.topic_name != topic) return;
    seen = seenOf(endpoint);
    seen->participant_user_data = participantUserData(endpoint.participant_key);
  });
  return seen;
}

std::string RosListener::participantUserData(const dds_guid_t& key) const {
  std::string user_data;
  forEachSeen<dds_builtintopic_participant_t>(participants_seen_,
                                              [&](const dds_builtintopic_participant_t& participant) {
                                                if (std::memcmp(&participant.key, &key, sizeof key) == 0)
                                                  user_data = userDataOf(participant.qos);
                                              });
  return user_data;
}

RosTalker::RosTalker(int domain)
    : participant_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)) {
  EXPECT_GT(participant_, 0) << dds_strretcode(-participant_);
}

RosTalker::~RosTalker() {
  dds_delete(participant_);
}

void RosTalker::advertise(const std::string& topic, const dds_topic_descriptor_t& type, bool reliable) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  const dds_entity_t entity = dds_create_topic(participant_, &type, topic.c_str(), nullptr, nullptr);
  const dds_entity_t writer = dds_create_writer(participant_, entity, qos, nullptr);
  EXPECT_GT(writer, 0) << topic << ": " << dds_strretcode(-writer);
  dds_delete_qos(qos);
  writers_[topic] = writer;
}

bool RosTalker::isMatched(const std::string& topic) const {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writers_.at(topic), &status) == DDS_RETCODE_OK &&
         status.current_count > 0;
}

dds_guid_t RosTalker::guidOf(const std::string& topic) const {
  dds_guid_t guid{};
  EXPECT_EQ(dds_get_guid(writers_.at(topic), &guid), DDS_RETCODE_OK);
  return guid;
}

void RosTalker::announce(const std::string& name_space, const std::string& node) {
  const auto gidOf = [](dds_entity_t entity) {
    dds_guid_t guid{};
    EXPECT_EQ(dds_get_guid(entity, &guid), DDS_RETCODE_OK);
    rmw_dds_common_msg_dds__Gid_ gid{};
    std::memcpy(gid.data, guid.v, sizeof gid.data);
    return gid;
  };
  std::vector<rmw_dds_common_msg_dds__Gid_> gids;
  for (const auto& [topic, writer] : writers_) gids.push_back(gidOf(writer));
  rmw_dds_common_msg_dds__NodeEntitiesInfo_ entry{};
  name_space.copy(entry.node_namespace, sizeof entry.node_namespace - 1);
  node.copy(entry.node_name, sizeof entry.node_name - 1);
  entry.writer_gid_seq._length = entry.writer_gid_seq._maximum = static_cast<std::uint32_t>(gids.size());
  entry.writer_gid_seq._buffer = gids.data();
  const rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ sample{gidOf(participant_), {1, 1, &entry, false}};
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t topic =
      dds_create_topic(participant_, &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc,
                       "ros_discovery_info", nullptr, nullptr);
  const dds_entity_t writer = dds_create_writer(participant_, topic, qos, nullptr);
  dds_delete_qos(qos);
  EXPECT_EQ(dds_write(writer, &sample), DDS_RETCODE_OK);
}

void RosTalker::publish(const std::string& topic, const void* sample,
                        std::optional<std::int64_t> sent_utc_ns) const {
  const dds_return_t result = sent_utc_ns ? dds_write_ts(writers_.at(topic), sample, *sent_utc_ns)
                                          : dds_write(writers_.at(topic), sample);
  EXPECT_EQ(result, DDS_RETCODE_OK) << topic << ": " << dds_strretcode(-result);
}

std::string hexOf(const std::string& bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

}  // namespace hapticd::test
