// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/dds/publisher.h"

#include <fmt/format.h>

#include "tools/lib/ros/type_hash.h"

namespace hapticd::tools::ros {

base::Result<Publisher> Publisher::open(const Participant& participant, const std::string& topic,
                                        std::string_view message, const dds_topic_descriptor_t& type,
                                        Late late) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, std::chrono::nanoseconds(kMaxBlocking).count());
  dds_qset_durability(qos,
                      late == Late::gets_last ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_writer_data_lifecycle(qos, /*autodispose=*/false);
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  const dds_entity_t entity =
      dds_create_topic(participant.get(), &type, ("rt/" + topic).c_str(), nullptr, nullptr);
  const std::string user_data = fmt::format("typehash={};", typeHash(message));
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  const dds_entity_t writer =
      entity < 0 ? entity : dds_create_writer(participant.get(), entity, qos, nullptr);
  dds_delete_qos(qos);
  if (writer < 0)
    return std::unexpected(base::Error{"topic " + topic,
                                       fmt::format("cannot be published: {}", dds_strretcode(-writer)),
                                       "another --domain may do"});
  return Publisher(writer, topic, std::string(message));
}

int Publisher::subscribers() const {
  dds_publication_matched_status_t status{};
  if (dds_get_publication_matched_status(writer_, &status) != DDS_RETCODE_OK) return 0;
  return static_cast<int>(status.current_count);
}

}  // namespace hapticd::tools::ros
