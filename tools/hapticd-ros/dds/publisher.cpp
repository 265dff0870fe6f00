// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/publisher.h"

#include <fmt/format.h>

#include "daemon/trace/ros/message_definitions.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::ros {

base::Result<Publisher> Publisher::open(const Participant& participant, const std::string& topic,
                                        std::string_view message, Late late, int depth) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, std::chrono::nanoseconds(kMaxBlocking).count());
  dds_qset_durability(qos,
                      late == Late::gets_last ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_writer_data_lifecycle(qos, /*autodispose=*/false);
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  const auto [entity, type] =
      createCdrTopic(participant.get(), ddsTopicName(topic), trace::ros::ddsTypeName(message));
  const std::string user_data = fmt::format("typehash={};", trace::ros::typeHash(message));
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  const dds_entity_t writer =
      entity < 0 ? entity : dds_create_writer(participant.get(), entity, qos, nullptr);
  dds_delete_qos(qos);
  if (writer < 0)
    return std::unexpected(base::Error{"topic " + topic,
                                       fmt::format("cannot be published: {}", dds_strretcode(-writer)),
                                       "another --domain, or a --namespace of fewer characters, may do"});
  return Publisher(topic, message, *type, writer);
}

bool Publisher::write(std::string message) {
  result_ = writeCdr(writer_, *type_, std::move(message));
  const bool done = result_ == DDS_RETCODE_OK;
  ++(done ? counts_->written : counts_->failed);
  return done;
}

int Publisher::subscribers() const {
  dds_publication_matched_status_t status{};
  if (dds_get_publication_matched_status(writer_, &status) != DDS_RETCODE_OK) return 0;
  return static_cast<int>(status.current_count);
}

base::Result<Publications> Publications::open(const Participant& participant, const std::string& name_space,
                                              std::span<const Topic> topics) {
  Publications all;
  for (const Topic topic : topics) {
    const TopicRow& row = rowOf(topic);
    const auto late = row.for_late ? Publisher::Late::gets_last : Publisher::Late::gets_nothing;
    auto publisher = Publisher::open(participant, nameOf(topic, name_space), row.message, late, row.depth);
    if (!publisher) return std::unexpected(publisher.error());
    all.publishers_[static_cast<std::size_t>(topic)] = std::move(*publisher);
  }
  return all;
}

std::uint64_t Publications::written() const noexcept {
  std::uint64_t sum = 0;
  for (const auto& publisher : publishers_) sum += publisher ? publisher->written() : 0;
  return sum;
}

std::uint64_t Publications::failed() const noexcept {
  std::uint64_t sum = 0;
  for (const auto& publisher : publishers_) sum += publisher ? publisher->failed() : 0;
  return sum;
}

std::vector<const Publisher*> Publications::publishers() const {
  std::vector<const Publisher*> all;
  for (const auto& publisher : publishers_) {
    if (publisher) all.push_back(&*publisher);
  }
  return all;
}

bool Publications::write(Topic topic, std::string message) {
  Publisher& publisher = *publishers_[static_cast<std::size_t>(topic)];
  if (publisher.write(std::move(message))) return true;
  if (problem_) return false;
  problem_ = base::Error{
      fmt::format("topic {}", publisher.topic()),
      fmt::format("a message could not be written: {}", dds_strretcode(-publisher.result())),
      publisher.result() == DDS_RETCODE_TIMEOUT ? "a subscriber does not keep up: a lower --rate helps"
                                                : "further ones are counted in the diagnostics"};
  return false;
}

}  // namespace hapticd::tools::ros
