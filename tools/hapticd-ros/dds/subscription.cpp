// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/subscription.h"

#include <fmt/format.h>

#include "daemon/trace/ros/message_definitions.h"
#include "tools/lib/ros/ros_name.h"

namespace hapticd::tools::ros {
namespace {

base::Error failure(const std::string& topic, dds_return_t code) {
  return {"topic " + topic, fmt::format("cannot be subscribed to: {}", dds_strretcode(-code)),
          "another --domain may do"};
}

}  // namespace

base::Result<Subscription> Subscription::open(const Participant& participant, const std::string& topic,
                                              std::string_view message, int depth, Delivery delivery) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(
      qos, delivery == Delivery::newest ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(qos,
                      delivery == Delivery::last ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  const dds_entity_t entity =
      createCdrTopic(participant.get(), ddsTopicName(topic), trace::ros::ddsTypeName(message)).entity;
  const std::string user_data = fmt::format("typehash={};", trace::ros::typeHash(message));
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  const dds_entity_t reader =
      entity < 0 ? entity : dds_create_reader(participant.get(), entity, qos, nullptr);
  dds_delete_qos(qos);
  if (reader < 0) return std::unexpected(failure(topic, reader));
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  return Subscription(reader);
}

int Subscription::publishers() const {
  dds_subscription_matched_status_t status{};
  if (dds_get_subscription_matched_status(reader_, &status) != DDS_RETCODE_OK) return 0;
  return static_cast<int>(status.current_count);
}

MessageWait::MessageWait(const Participant& participant)
    : waitset_(dds_create_waitset(participant.get())), ending_(dds_create_guardcondition(participant.get())) {
  dds_waitset_attach(waitset_.get(), ending_.get(), 0);
}

void MessageWait::add(const Subscription& subscription) {
  dds_waitset_attach(waitset_.get(), subscription.reader(), 0);
}

void MessageWait::wait(std::chrono::nanoseconds at_most) {
  dds_waitset_wait(waitset_.get(), nullptr, 0, at_most.count());
}

void MessageWait::end() {
  dds_set_guardcondition(ending_.get(), true);
}

bool MessageWait::ended() const {
  bool ended = false;
  dds_read_guardcondition(ending_.get(), &ended);
  return ended;
}

}  // namespace hapticd::tools::ros
